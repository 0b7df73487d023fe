// download.js: files of a job. They are fetched with the token and then saved: an address with a token in it there is not.

import { announce, h } from "./dom.js";

/** Saves bytes under a name. */
export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  const link = h("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}

/** Buttons for files: [{name, path, text}]. */
export function download_buttons(api, files, on_error) {
  return h("div", { class: "buttons downloads" }, files.map(({ name, path, text }) => {
    const button = h("button", { type: "button", class: "small", "data-file": name, onclick: async () => {
      button.disabled = true;
      try {
        save(await api.blob(path), name);
        announce(`${name} is saved`);
      } catch (error) {
        on_error(error);
      }
      button.disabled = false;
    } }, text);
    return button;
  }));
}

/** What there is to save of an ended job; case_name: of this load case. */
export async function files_of(api, job, case_name) {
  const base = `/v1/jobs/${job.id}`, query = case_name ? `case=${encodeURIComponent(case_name)}` : "";
  const of_case = (path, more = "") => `${base}/${path}${[query, more].filter(Boolean).length ? "?" : ""}${[query, more].filter(Boolean).join("&")}`;
  const stem = case_name ? `${job.id.slice(-8)}-${case_name}` : job.id.slice(-8);
  const files = [{ name: `${stem}-job.json`, path: base, text: "Job, JSON" },
    { name: `${job.id.slice(-8)}-request.json`, path: `${base}/request`, text: "Request, JSON" }];
  if (job.status !== "successful") return files;
  const fields = job.summary?.problem?.kind === "scene" ? "summary,nodes,displacements,reactions,gaps,pressure" : "summary,displacements,reactions,gaps";
  files.push({ name: `${stem}-result.json`, path: of_case("result", `fields=${fields}`), text: "Result, JSON" },
    { name: `${stem}-history.csv`, path: of_case("history.csv"), text: "History, CSV" });
  if (await api.offers("/v1/jobs/{id}/convergence.svg"))
    files.push({ name: `${stem}-convergence.svg`, path: of_case("convergence.svg"), text: "Convergence, SVG" });
  if (await api.offers("/v1/jobs/{id}/whole-error.svg"))
    files.push({ name: `${stem}-whole-error.svg`, path: of_case("whole-error.svg"), text: "Whole error, SVG" });
  if (job.summary?.problem?.kind === "scene")
    files.push({ name: `${stem}.vtu`, path: of_case("result.vtu"), text: "Fields, VTU" },
      { name: `${stem}-deformed.svg`, path: of_case("deformed.svg"), text: "Deformed body, SVG" });
  return files;
}
