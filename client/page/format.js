// format.js: numbers, times and sizes for people.

const SUPERSCRIPTS = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/** "⁻¹²" */
export function superscript(exponent) {
  return String(exponent).replace("-", "⁻").replace(/\d/g, (digit) => SUPERSCRIPTS[digit]);
}

function scientific(value, digits) {
  const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
  return `${mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa}×10${superscript(Number(exponent))}`;
}

/** A number with so many significant digits: 0.0032, 1.2×10⁻⁹, 12,300. */
export function number(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-3) return scientific(value, digits);
  return Number(value.toPrecision(digits)).toLocaleString("en", { maximumSignificantDigits: Math.max(digits, Math.ceil(Math.log10(size))) });
}

/** A bound from below (way -1) or above (1) in so many digits, rounded to that side. */
export function number_towards(value, digits, way) {
  if (!Number.isFinite(value) || value === 0) return number(value, digits);
  const unit = 10 ** (Math.floor(Math.log10(Math.abs(value))) - digits + 1);
  const near = Number(value.toPrecision(digits));
  return number(way * (near - value) < 0 ? near + way * unit : near, digits);
}

export function count(value) {
  return value === null || value === undefined ? "–" : value.toLocaleString("en");
}

/** "1 iteration", "599 iterations" */
export function counted(value, noun) {
  return `${count(value)} ${noun}${value === 1 ? "" : "s"}`;
}

/** A relative number as per cent, plain as long as that is readable: "0.0003 %", "1.2×10⁻⁹ %". */
export function percent(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const p = 100 * value;
  if (p === 0) return "0 %";
  if (Math.abs(p) >= 1e-6 && Math.abs(p) < 1e4) {
    const places = Math.min(20, Math.max(0, 1 - Math.floor(Math.log10(Math.abs(p)))));
    return `${p.toFixed(places).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "")} %`;
  }
  return `${number(p, 2)} %`;
}

/** The same, never smaller than it is: a bound must not be rounded down. */
export function percent_up(value) {
  if (!(value > 0) || !Number.isFinite(value)) return percent(value);
  const scale = 10 ** (Math.floor(Math.log10(value)) - 1);
  const up = Math.ceil(value / scale - 1e-9) * scale;
  return percent(up);
}

/** Seconds: "340 µs", "12 ms", "1.2 s", "3 min 5 s". */
export function seconds(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0 s";
  if (value < 1e-3) return `${number(value * 1e6, 3)} µs`;
  if (value < 1) return `${number(value * 1e3, 3)} ms`;
  if (value < 60) return `${number(value, 3)} s`;
  const whole = Math.round(value), h = Math.floor(whole / 3600), min = Math.floor(whole / 60) % 60;
  return h > 0 ? `${h} h ${min} min` : `${min} min ${whole % 60} s`;
}

export function bytes(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const units = ["B", "kB", "MB", "GB", "TB"];
  let i = 0;
  while (value >= 1000 && i < units.length - 1) {
    value /= 1000;
    i++;
  }
  return `${number(value, 3)} ${units[i]}`;
}

/** A moment (RFC 3339) as local time; the day too unless it is today. */
export function moment(text, now = new Date()) {
  if (!text) return "–";
  const at = new Date(text);
  const time = at.toLocaleTimeString("en-GB");
  return at.toDateString() === now.toDateString() ? time : `${at.toLocaleDateString("en-CA")} ${time}`;
}

/** Seconds between two moments; the second may be now. */
export function elapsed(from, to) {
  return from ? ((to ? new Date(to) : new Date()) - new Date(from)) / 1000 : null;
}

/** How much of an id tells jobs apart at a glance: its end is random, its beginning the time. */
export function short_id(id) {
  return id.slice(-8);
}
