// main.js: the frame of the page: header, addresses, keys. Each view is a function (element, context, argument) that
// fills the element and returns what ends it; views that are not the first are loaded when they are first shown.

import { make_api } from "./api.js";
import { h, show } from "./dom.js";
import { show_list } from "./list.js";
import { show_keys, listen_keys } from "./keys.js";
import { theme, turn_theme } from "./theme.js";
import { ask_token, forget_token, on_token, token } from "./token.js";

const api = make_api({ token, ask: ask_token });
const main = document.getElementById("main");
const bar = document.getElementById("bar");

const VIEWS = [
  { pattern: /^$/, home: "", title: "Jobs", load: async () => show_list },
  { pattern: /^new(?:\/(\w+))?$/, home: "new", title: "New job", load: async () => (await import("./editor.js")).show_editor },
  { pattern: /^compare(?:\/([\w.-]+))?$/, home: "compare", title: "Compare accuracies", load: async () => (await import("./compare.js")).show_compare },
  { pattern: /^side\/([0-9a-f]{32}(?:\.[0-9a-f]{32}){0,5})$/, home: "", title: "Jobs side by side", load: async () => (await import("./side.js")).show_side },
  { pattern: /^jobs\/([0-9a-f]{32})$/, home: "", title: "Job", load: async () => (await import("./job.js")).show_job },
];

let end_view = null, turn = 0;

/** What stands after "#/" in the address. */
function place() {
  return location.hash.replace(/^#\/?/, "");
}

/** Says in the header which view this is, or belongs to. */
function mark_home(view, at) {
  for (const link of bar.querySelectorAll("nav a")) {
    const here = view && link.getAttribute("href") === `#/${view.home}`;
    if (here) link.setAttribute("aria-current", view.home === at ? "page" : "true");
    else link.removeAttribute("aria-current");
  }
}

async function go() {
  const at = place(), mine = ++turn;
  const view = VIEWS.find((one) => one.pattern.test(at));
  end_view?.();
  end_view = null;
  main.replaceChildren(); // nothing of a view that has ended can be pressed while the next is loaded
  mark_home(view, at);
  document.title = `${view ? view.title : "Nothing here"} · Contact solver`;
  if (!view) {
    show(main, h("h1", null, "Nothing here"), h("p", null, "This address leads nowhere. ", h("a", { href: "#/" }, "All jobs")));
    return;
  }
  const run = await view.load().catch(() => null);
  if (mine !== turn) return;
  if (!run) { // a browser may keep what failed to load until the page is loaded anew
    show(main, h("h1", null, view.title), h("p", { class: "bad", role: "alert" }, "The service does not answer. Is it still running?"),
      h("button", { type: "button", onclick: () => location.reload() }, "Try again"));
    return;
  }
  end_view = run(main, { api, token }, view.pattern.exec(at)[1]);
}

function theme_button() {
  const words = { auto: "Theme: as the system", light: "Theme: light", dark: "Theme: dark" };
  const signs = { auto: "◐", light: "☀", dark: "☾" };
  const button = h("button", { type: "button", id: "theme", class: "plain" });
  const say = () => {
    button.setAttribute("aria-label", words[theme()]);
    button.title = words[theme()];
    show(button, h("span", { "aria-hidden": "true" }, signs[theme()]));
  };
  button.addEventListener("click", () => (turn_theme(), say()));
  say();
  return button;
}

function token_button() {
  const button = h("button", { type: "button", id: "token", class: "plain", onclick: () => (forget_token(), go()) }, "Forget token");
  const say = () => (button.hidden = !token());
  on_token(say);
  say();
  return button;
}

show(bar,
  h("a", { href: "#/", class: "brand" }, "Contact solver"),
  h("nav", { "aria-label": "Views" },
    h("a", { href: "#/" }, "Jobs"), h("a", { href: "#/new" }, "New job"), h("a", { href: "#/compare" }, "Compare")),
  h("div", { class: "tools" }, token_button(),
    h("button", { type: "button", id: "keys", class: "plain", "aria-label": "Keyboard shortcuts", title: "Keyboard shortcuts", onclick: show_keys }, "?"),
    theme_button()));
document.querySelector(".skip").addEventListener("click", (event) => {
  event.preventDefault(); // the address is the view's
  main.focus();
});
listen_keys({ theme: () => document.getElementById("theme").click() });
addEventListener("hashchange", () => go().then(() => main.focus({ preventScroll: false })));
go();
