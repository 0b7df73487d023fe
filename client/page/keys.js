// keys.js: shortcuts of one key. They can be switched off (WCAG 2.2, success criterion 2.1.4) and do nothing while
// something is being written.

import { h } from "./dom.js";

const KEY = "shortcuts";
const LIST = [
  ["l", "all jobs"], ["n", "new job"], ["c", "compare accuracies"], ["/", "to the search of the list"],
  ["j, k", "next and previous job of the list; Enter opens it"], ["t", "light, dark, as the system"], ["?", "this list"],
];

let on = true;
try {
  on = localStorage.getItem(KEY) !== "off";
} catch {
  on = true;
}

function keep(value) {
  on = value;
  try {
    localStorage.setItem(KEY, on ? "on" : "off");
  } catch {
    // then it holds for this visit
  }
}

export function show_keys() {
  const dialog = h("dialog", { id: "keys-dialog", "aria-labelledby": "keys-title", onclose: () => dialog.remove() },
    h("h2", { id: "keys-title" }, "Keyboard shortcuts"),
    h("dl", { class: "keys" }, LIST.map(([key, what]) => [h("dt", null, h("kbd", null, key)), h("dd", null, what)])),
    h("label", { class: "check" },
      h("input", { type: "checkbox", checked: on, onchange: (event) => keep(event.target.checked) }), "shortcuts of one key"),
    h("div", { class: "buttons" }, h("button", { type: "button", class: "primary", onclick: () => dialog.close() }, "Close")));
  document.body.append(dialog);
  dialog.showModal();
}

function writing(target) {
  return target.closest?.("input, textarea, select, [contenteditable]") || document.querySelector("dialog[open]");
}

function to_filter() {
  const filter = document.getElementById("search");
  filter?.focus();
  return Boolean(filter);
}

/** actions: {theme()}. j and k go to the list by the event "listmove" of the document. */
export function listen_keys(actions) {
  const move = (by) => document.dispatchEvent(new CustomEvent("listmove", { detail: by }));
  const keys = {
    l: () => (location.hash = "#/"), n: () => (location.hash = "#/new"), c: () => (location.hash = "#/compare"),
    t: actions.theme, "?": show_keys, j: () => move(1), k: () => move(-1), "/": to_filter,
  };
  document.addEventListener("keydown", (event) => {
    if (!on || event.ctrlKey || event.altKey || event.metaKey || writing(event.target) || !keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
}
