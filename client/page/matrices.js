// matrices.js: a problem in matrices from four files, which are uploaded; the job then names them.

import { h, show } from "./dom.js";

const FILES = [["K", "the stiffness matrix"], ["N", "the contact normals, a row for each"], ["h", "the initial gaps"], ["p", "the load"]];

/** A form that opens; on_text(text): the job as JSON, once K and p, and N and h both or neither, are there. */
export function matrices_form(api, on_text) {
  const ids = {}, chosen = {}, said = h("p", { class: "muted", role: "status" }, "Files in Matrix Market form, also packed by gzip: chosen, or dropped on their field. Without N and h nothing touches.");
  async function take(name, file) {
    chosen[name] = file;
    delete ids[name]; // of a file that was chosen before
    said.className = "muted";
    show(said, `${file.name} is being sent …`);
    try {
      const reply = await api.fetch("/v1/uploads", { method: "POST", body: file, headers: { "Content-Type": "application/octet-stream", ...(/\.gz$/.test(file.name) ? { "Content-Encoding": "gzip" } : {}) } });
      const { id } = await reply.json();
      if (chosen[name] !== file || !form.isConnected) return; // another one, or left
      ids[name] = id;
    } catch (error) {
      if (chosen[name] !== file) return;
      said.className = "bad";
      show(said, `${file.name}: ${error.message}`);
      return;
    }
    const lacks = FILES.map(([one]) => one).filter((one) => !ids[one] && (one === "K" || one === "p" || ids.N || ids.h));
    show(said, lacks.length ? `Still to come: ${lacks.join(", ")}.` : "The job names the files.");
    if (lacks.length) return;
    const members = FILES.filter(([one]) => ids[one]).map(([one]) => `    "${one}": {"upload": "${ids[one]}"}`);
    on_text(`{\n  "problem": {\n    "kind": "matrices",\n${members.join(",\n")}\n  },\n  "solver": {"accuracy": "precise"}\n}`);
  }
  const form = h("details", { class: "matrices" }, h("summary", null, "A problem in matrices"), h("div", { class: "matrices-files" }, FILES.map(([name, what]) => {
    const field = h("input", { type: "file", id: `matrix-${name}`, accept: ".mtx,.gz,.txt", onchange: () => field.files[0] && take(name, field.files[0]) });
    return h("label", null, h("span", null, h("code", null, name), ` ${what}`), field);
  })), said);
  return form;
}
