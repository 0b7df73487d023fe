// path.js: displacement and stress along a straight line through a body (GET /v1/jobs/{id}/path). Its ends are typed, or
// picked in the picture of the body.

import { box_of } from "./body_obstacles.js";
import { place_of } from "./body_surface.js";
import { Curve } from "./curve.js";
import { h, show } from "./dom.js";
import { save } from "./download.js";
import { number } from "./format.js";
import { unit_of } from "./units.js";

const POINTS = 201;
const written = (point) => point.map((x) => Number(x.toPrecision(5))).join(", ");

/** From end to end of the body along its longest axis, through its middle. */
function first_line(surface) {
  const box = box_of(surface).map((corner) => corner.slice(0, surface.dim).map((x, c) => surface.origin[c] + surface.unit * x));
  const sizes = box[1].map((x, c) => x - box[0][c]), along = sizes.indexOf(Math.max(...sizes));
  return box.map((corner) => corner.map((x, c) => (c === along ? x : (box[0][c] + box[1][c]) / 2)));
}

/** What the reply has at each point, as columns of numbers. */
function columns_of(got, units) {
  const dim = got.points[0].length, words = (x) => number(x, 5), of = (what) => unit_of({ problem: { units } }, what);
  const column = (key, name, what, values) => ({ key, name, unit: of(what), words, values });
  return [column("von_mises", "von Mises stress", "stress", got.von_mises),
    column("u", "Displacement", "length", got.displacements.map((u) => (u[0] === null ? null : Math.hypot(...u)))),
    ...Array.from({ length: dim }, (_, c) => column(`u${c}`, `Displacement along ${"xyz"[c]}`, "length", got.displacements.map((u) => u[c]))),
    ...got.components.map((name, c) => column(`stress_${name}`, `Stress ${name}`, "stress", got.stress.map((one) => one[c])))];
}

/**
 * A part of a page that opens. surface: of the body. on_line(points): the line in the picture, [{at, u}] of the points
 * that are in the body, null: none; pick(act): calls act(vertex) at the next click on the body, null: no longer.
 * Returns {destroy()}.
 */
export function mountPath(element, api, job, { case: case_name, units, surface, on_line, pick }) {
  const ends = new AbortController(), line = first_line(surface);
  let got = null, asking = null;
  const typed = ["From", "To"].map((name, k) => h("input", { id: `path-${name.toLowerCase()}`, class: "path-end", value: written(line[k]), autocomplete: "off", onchange: () => load() }));
  const trouble = h("p", { class: "bad", role: "alert", hidden: true });
  const picker = h("button", { type: "button", class: "small", id: "path-pick", "aria-pressed": "false", onclick: () => pick_end(picker.getAttribute("aria-pressed") === "true" ? 2 : 0) }, "Click both in the picture");
  const file = h("button", { type: "button", class: "small", title: "Save all numbers", onclick: () =>
    api.blob(address("path.csv"), { signal: ends.signal }).then((blob) => save(blob, `path-${job.slice(-8)}.csv`), complain) }, "CSV");
  const curve = new Curve("path-curve", (column) => ({ x: { label: `distance from (${typed[0].value})${unit_of({ problem: { units } }, "length").replace(" ", ", ")}` },
    series: [{ name: column.name, colour: 1, gaps: true, points: got.distance.map((x, i) => [x, column.values[i] ?? NaN]) }],
    label: `${column.name} along the line from (${typed[0].value}) to (${typed[1].value})` }));
  const details = h("details", { class: "path", ontoggle: () => (details.open ? load() : (asking?.abort(), pick_end(2), on_line(null))) }, h("summary", null, "Along a line through the body"),
    h("div", { class: "body-tools" }, typed.map((field, k) => h("label", null, ["From", "to"][k], field)), picker, curve.choice, file), trouble, curve.place);
  show(element, details);

  function address(name) {
    const query = new URLSearchParams({ from: typed[0].value.replace(/\s/g, ""), to: typed[1].value.replace(/\s/g, ""), count: POINTS });
    if (case_name) query.set("case", case_name);
    return `/v1/jobs/${job}/${name}?${query}`;
  }

  /** Ends are picked one after the other; 2: no more. */
  function pick_end(k) {
    picker.setAttribute("aria-pressed", String(k < 2));
    show(picker, k < 2 ? `Click on the body: ${["from", "to"][k]} …` : "Click both in the picture");
    pick(k === 2 ? null : (vertex) => {
      typed[k].value = written(place_of(surface, vertex));
      pick_end(k + 1);
      if (k === 1) load();
    });
  }

  function complain(error) {
    if (ends.signal.aborted) return;
    trouble.hidden = false;
    show(trouble, error.message);
  }

  /** Of a line that was changed meanwhile nothing is wanted any more. */
  async function load() {
    asking?.abort();
    const { signal } = (asking = new AbortController());
    try {
      got = await api.get(address("path"), { signal });
      if (signal.aborted) return;
      trouble.hidden = true;
      curve.take(columns_of(got, units), "von_mises");
      on_line(got.points.map((at, i) => ({ at, u: got.displacements[i] })).filter(({ u }) => u[0] !== null));
    } catch (error) {
      if (!signal.aborted) complain(error);
    }
  }

  return {
    destroy: () => {
      ends.abort();
      asking?.abort();
      curve.destroy();
    },
  };
}
