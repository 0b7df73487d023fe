// body.js: the deformed body of a job, as the service draws it.

import { h, show } from "./dom.js";

/**
 * Shows the body of a job in an element.
 * api: of api.js (fetch, get, bytes, blob: with the token). options: {cases: names of its load cases, case: the one
 * that is shown first}. Colours are the variables of page.css; the document's event "themechange" tells that they
 * changed. Returns {destroy()}, which stops everything and frees what was made.
 */
export async function mountBody(element, api, jobId, options = {}) {
  const query = options.case ? `?case=${encodeURIComponent(options.case)}` : "";
  const address = URL.createObjectURL(await api.blob(`/v1/jobs/${jobId}/deformed.svg${query}`));
  show(element, h("img", { src: address, alt: "The deformed body", class: "picture" }));
  return {
    destroy() {
      URL.revokeObjectURL(address);
      element.replaceChildren();
    },
  };
}
