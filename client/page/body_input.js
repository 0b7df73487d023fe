// body_input.js: pointers, wheel and keys on the picture of a body.

const STEP = 24, TURN = Math.PI / 24, ZOOM = 1.25, DRAG_TURN = 0.008;

/**
 * Listens on a canvas until the signal ends it. view(): the Camera; changed() after each change of it; home() shows all;
 * over(x, y, is_tap) for a pointer that does not drag, over(null) when it leaves.
 */
export function listen(canvas, view, { changed, home, over }, signal) {
  const pointers = new Map();
  let dragged = false;
  const at = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const on = (name, act, more) => canvas.addEventListener(name, act, { signal, ...more });

  on("pointerdown", (event) => {
    if (pointers.size === 0) dragged = false;
    pointers.set(event.pointerId, at(event));
    try {
      canvas.setPointerCapture(event.pointerId);
    } catch {
      // the pointer is gone already
    }
  });
  on("pointermove", (event) => {
    const to = at(event), from = pointers.get(event.pointerId);
    if (!from) return over(...to, false);
    if (!dragged && Math.hypot(to[0] - from[0], to[1] - from[1]) < 3) return undefined;
    dragged = true;
    if (pointers.size === 1) drag(view(), from, to, event.shiftKey || event.buttons === 2 || event.buttons === 4);
    else pinch(view(), [...pointers].filter(([id]) => id !== event.pointerId)[0][1], from, to);
    pointers.set(event.pointerId, to);
    return changed();
  });
  for (const name of ["pointerup", "pointercancel"])
    on(name, (event) => {
      if (name === "pointerup" && !dragged && pointers.has(event.pointerId)) over(...at(event), true);
      pointers.delete(event.pointerId);
    });
  on("pointerleave", () => over(null));
  on("contextmenu", (event) => event.preventDefault());
  on("dblclick", home);
  // The page scrolls under a picture that is not in use.
  on("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 20 : 1;
    view().zoom(Math.exp(-Math.max(-300, Math.min(300, event.deltaY * lines)) / 400), ...at(event));
    changed();
  }, { passive: false });
  on("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !press(view(), event, home)) return;
    event.preventDefault();
    event.stopPropagation();
    changed();
  });
}

function drag(view, from, to, moves) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  if (view.dim === 3 && !moves) view.rotate(DRAG_TURN * dx, DRAG_TURN * dy);
  else view.pan(dx, dy);
}

/** Two fingers: what was between them stays between them. */
function pinch(view, other, from, to) {
  const before = Math.hypot(from[0] - other[0], from[1] - other[1]), after = Math.hypot(to[0] - other[0], to[1] - other[1]);
  view.pan((to[0] - from[0]) / 2, (to[1] - from[1]) / 2);
  if (before > 10 && after > 10) view.zoom(after / before, (to[0] + other[0]) / 2, (to[1] + other[1]) / 2);
}

/** True if the key means something here. */
function press(view, event, home) {
  const ways = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }, way = ways[event.key];
  if (way && view.dim === 3 && !event.shiftKey) view.rotate(way[0] * TURN, way[1] * TURN);
  else if (way) view.pan(way[0] * STEP, way[1] * STEP);
  else if (event.key === "+" || event.key === "=") view.zoom(ZOOM);
  else if (event.key === "-" || event.key === "_") view.zoom(1 / ZOOM);
  else if (event.key === "0" || event.key === "Home") home();
  else return false;
  return true;
}
