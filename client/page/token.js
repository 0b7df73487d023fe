// token.js: the token that a service with --tokens asks for. It is kept in memory, or for this tab (sessionStorage) where
// the person says so; never in an address, a cookie or localStorage.

import { h } from "./dom.js";

const KEY = "token";
let secret = "";
try {
  secret = sessionStorage.getItem(KEY) || "";
} catch {
  secret = ""; // storage may be forbidden
}

const listeners = new Set();

export function token() {
  return secret;
}

/** Calls f() whenever there is a token or no longer one; returns what ends that. */
export function on_token(f) {
  listeners.add(f);
  return () => listeners.delete(f);
}

function keep(value, for_tab) {
  secret = value;
  try {
    if (value && for_tab) sessionStorage.setItem(KEY, value);
    else sessionStorage.removeItem(KEY);
  } catch {
    // then it holds until the page is left
  }
  for (const f of listeners) f();
}

export function forget_token() {
  keep("", false);
}

/** Asks for a token; whether one was given. refused: one was sent and not accepted. */
export function ask_token(refused) {
  return new Promise((resolve) => {
    const field = h("input", { id: "token-field", type: "password", autocomplete: "off", spellcheck: "false", required: true,
      maxlength: 128, "aria-describedby": "token-why" });
    const for_tab = h("input", { type: "checkbox", id: "token-keep" });
    const done = (given) => {
      dialog.close();
      dialog.remove();
      resolve(given);
    };
    const take = (event) => {
      event.preventDefault();
      const value = field.value.trim();
      if (!value) return;
      keep(value, for_tab.checked);
      done(true);
    };
    const dialog = h("dialog", { id: "token-dialog", "aria-labelledby": "token-title" },
      h("form", { onsubmit: take },
        h("h2", { id: "token-title" }, "Token"),
        h("p", { id: "token-why", class: refused ? "bad" : "" },
          refused ? "The service did not accept this token. Another one?" : "This service asks for a token: its operator has it."),
        h("label", { for: "token-field" }, "Token"), field,
        h("label", { class: "check" }, for_tab, "keep it until this tab is closed"),
        h("div", { class: "buttons" },
          h("button", { type: "submit", class: "primary" }, "Use it"),
          h("button", { type: "button", onclick: () => done(false) }, "Not now"))));
    dialog.addEventListener("cancel", (event) => {
      event.preventDefault();
      done(false);
    });
    document.body.append(dialog);
    dialog.showModal();
    field.focus();
  });
}
