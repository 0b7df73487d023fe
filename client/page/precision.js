// precision.js: when each decade of accuracy was first certified, GET /v1/jobs/{id}/work-precision.

import { h, show } from "./dom.js";
import { number, seconds } from "./format.js";
import { Chart } from "./plot.js";

/** Draws it in an element; returns what ends it, null where there is none. */
export async function show_precision(element, api, id, case_name, signal) {
  const query = case_name ? `?case=${encodeURIComponent(case_name)}` : "";
  const got = await api.get(`/v1/jobs/${id}/work-precision${query}`, { signal });
  const decades = (got.decades || []).filter((one) => Number.isFinite(one.seconds) && one.seconds > 0);
  if (!decades.length) return null;
  const place = h("div");
  show(element, h("h2", null, "Time against certified error"), place,
    h("p", { class: "muted" }, `Certified to ${number(decades[decades.length - 1].relative_error)} after ${seconds(decades[decades.length - 1].seconds)}.`));
  const chart = new Chart(place, 240);
  const points = decades.map((one) => [one.seconds, one.relative_error]).sort((a, b) => a[0] - b[0]);
  const series = [{ name: "first certified", colour: 1, dots: true, points }];
  const levels = (got.levels || []).filter((one) => one.seconds > 0 && one.relative_error > 0);
  if (levels.length)
    series.push({ name: "a whole solve at this level", colour: 3, line: false, texts: true, size: 5,
      points: levels.map((one) => [one.seconds, one.relative_error, one.level]) });
  if (Number.isFinite(got.mesh_error) && got.mesh_error > 0) {
    series.push({ name: "whole error: both together", colour: 4, points: points.map(([at, error]) => [at, Math.hypot(error, got.mesh_error)]) });
    series.push({ name: "error of the mesh, estimated", colour: 2, dash: "6 3", across: true, points: [[points[0][0], got.mesh_error]] });
  }
  chart.update({ x: { label: "time", log: true, format: seconds }, y: { label: "relative error", log: true }, series,
    label: `When each decade of the relative error was first certified, from ${seconds(points[0][0])} to ${seconds(points[points.length - 1][0])}` });
  return () => chart.destroy();
}
