// menu.js: a button that opens a list of actions (WAI-ARIA's menu button): what is seldom wanted, or cannot be undone,
// is one step away from a click that slips.

import { h } from "./dom.js";

/**
 * items: () => [{label, act, sure}]. What is sure is asked again: the first press changes its words to `sure`, the second
 * acts. act may be async; on_error(error) hears of what it throws.
 */
export function menu_button(name, items, on_error = () => {}) {
  let menu = null;
  const button = h("button", { type: "button", class: "small menu-button", "aria-haspopup": "menu", "aria-expanded": "false", "aria-label": name, title: name }, "⋯");
  const close = () => {
    const open_one = menu;
    menu = null; // first: what is removed loses the focus, which closes it
    open_one?.remove();
    button.setAttribute("aria-expanded", "false");
  };
  const leave = () => {
    close();
    if (button.isConnected) button.focus({ preventScroll: true });
  };
  const pick = async (item, entry) => {
    if (item.sure && entry.textContent !== item.sure) {
      entry.textContent = item.sure;
      entry.classList.add("bad");
      return;
    }
    leave();
    try {
      await item.act();
    } catch (error) {
      on_error(error);
    }
  };
  const open = () => {
    const entries = items().map((item) => {
      const entry = h("button", { type: "button", role: "menuitem", tabindex: "-1", "data-label": item.label }, item.label);
      entry.addEventListener("click", () => pick(item, entry));
      return entry;
    });
    menu = h("div", { role: "menu", class: "menu", "aria-label": name, onkeydown: (event) => move(event, entries), onfocusout: (event) => {
      if (menu && !menu.contains(event.relatedTarget) && event.relatedTarget !== button) close();
    } }, entries);
    document.body.append(menu);
    const at = button.getBoundingClientRect(), box = menu.getBoundingClientRect();
    const below = at.bottom + 4 + box.height <= innerHeight;
    menu.style.left = `${Math.max(8, Math.min(at.right - box.width, innerWidth - box.width - 8)) + scrollX}px`;
    menu.style.top = `${(below ? at.bottom + 4 : at.top - box.height - 4) + scrollY}px`;
    button.setAttribute("aria-expanded", "true");
    entries[0]?.focus({ preventScroll: true });
  };
  const move = (event, entries) => {
    const now = entries.indexOf(document.activeElement), last = entries.length - 1;
    const to = { ArrowDown: now >= last ? 0 : now + 1, ArrowUp: now <= 0 ? last : now - 1, Home: 0, End: last }[event.key];
    if (event.key === "Escape") leave();
    else if (event.key === "Tab") return close();
    else if (to === undefined) return undefined;
    else entries[to].focus();
    event.preventDefault();
    return event.stopPropagation();
  };
  button.addEventListener("click", () => (menu ? leave() : open()));
  return button;
}
