// refine.js: asks an ended job for a tighter answer.

import { idempotency_key } from "./api.js";
import { h, show } from "./dom.js";

/** A button that becomes a small form; the new job is shown when it is made. */
export function refine_form(api, job) {
  const level = h("select", { id: "refine-level" },
    ["1e-4", "1e-6", "1e-8", "1e-10", "precise", "exact"].map((one) => h("option", { value: one }, one === "exact" || one === "precise" ? one : `≤ ${one}`)));
  level.value = "exact";
  const trouble = h("p", { class: "bad", role: "alert", hidden: true });
  const key = idempotency_key();
  const send = async (event) => {
    event.preventDefault();
    const accuracy = Number.isFinite(Number(level.value)) ? { relative_error: Number(level.value) } : level.value;
    try {
      const made = await api.post(`/v1/jobs/${job.id}/refine`, JSON.stringify({ accuracy }), { headers: { "Idempotency-Key": key + level.value } });
      if (form.isConnected) location.hash = `#/jobs/${made.id}`;
    } catch (error) {
      trouble.hidden = false;
      show(trouble, error.message);
    }
  };
  const form = h("form", { class: "refine", hidden: true, onsubmit: send }, h("label", { for: "refine-level" }, "Relative error"), level,
    h("button", { type: "submit", class: "primary" }, "Go on from here"), trouble);
  const open = h("button", { type: "button", id: "refine", class: "small", "aria-expanded": "false", onclick: () => {
    form.hidden = !form.hidden;
    open.setAttribute("aria-expanded", String(!form.hidden));
  } }, "Refine");
  return [open, form];
}
