// job.js: one job.

import { h, show } from "./dom.js";

/** The body of a job that has one: drawn when it is asked for, by code that is loaded then. */
function body_section(api, id, ends) {
  const place = h("div", { class: "body", id: "body" });
  const open = h("button", { type: "button", id: "open-body", onclick: async () => {
    const { mountBody } = await import("./body.js");
    const body = await mountBody(place, api, id, {});
    ends.push(() => body.destroy());
  } }, "Show the body");
  show(place, open);
  return h("section", { "aria-label": "Body" }, h("h2", null, "Body"), place);
}

export function show_job(main, { api }, id) {
  const ends = [];
  show(main, h("h1", null, "Job ", h("code", null, id)), body_section(api, id, ends));
  return () => ends.forEach((end) => end());
}
