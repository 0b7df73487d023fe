// theme.js: light, dark, or as the system says. The colours are variables of page.css; what draws by itself (canvas,
// WebGL) reads them by colour() and draws again on the event "themechange" of the document.

const KEY = "theme";
const ORDER = ["auto", "light", "dark"];

function stored() {
  try {
    return ORDER.includes(localStorage.getItem(KEY)) ? localStorage.getItem(KEY) : "auto";
  } catch {
    return "auto"; // storage may be forbidden
  }
}

let choice = stored();

function apply() {
  if (choice === "auto") document.documentElement.removeAttribute("data-theme");
  else document.documentElement.setAttribute("data-theme", choice);
  document.dispatchEvent(new Event("themechange"));
}

export function theme() {
  return choice;
}

/** The next choice of auto, light, dark. */
export function turn_theme() {
  choice = ORDER[(ORDER.indexOf(choice) + 1) % ORDER.length];
  try {
    localStorage.setItem(KEY, choice);
  } catch {
    // then it holds for this visit
  }
  apply();
  return choice;
}

/** The colour of a variable of page.css, as "#rrggbb" or what stands there: colour("--series-1"). */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

export function is_dark() {
  return choice === "dark" || (choice === "auto" && matchMedia("(prefers-color-scheme: dark)").matches);
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", apply);
apply();
