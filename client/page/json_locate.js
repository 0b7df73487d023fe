// json_locate.js: where in a JSON text something is: the first mistake, or what a JSON pointer (RFC 6901) names. It reads
// as strictly as RFC 8259 says, which is how the service reads.

const DEPTH = 500;
const NUMBER = /-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][+-]?\d+)?/y;
const SPACE = /[ \t\r\n]*/y;
const STRING = /"(?:[^"\\\u0000-\u001f]|\\(?:["\\/bfnrt]|u[0-9a-fA-F]{4}))*"/y;

class Mistake {
  constructor(at, message) {
    Object.assign(this, { at, message });
  }
}

class Reader {
  /** wanted: the tokens of a pointer that is looked for; caret: an offset whose pointer is. */
  constructor(text, wanted, caret = -1) {
    Object.assign(this, { text, wanted, caret, at: 0, found: null, path: [], here: null });
  }

  /** Reads one member; the innermost whose text has the caret in it is where that is. */
  member(token, from, read) {
    this.path.push(token);
    if (from <= this.caret) {
      const before = this.here;
      this.here = [...this.path];
      read();
      if (this.at < this.caret) this.here = before;
    } else read();
    this.path.pop();
  }

  match(pattern) {
    pattern.lastIndex = this.at;
    const hit = pattern.exec(this.text);
    if (!hit) return null;
    this.at = pattern.lastIndex;
    return hit[0];
  }

  space() {
    this.match(SPACE);
  }

  expect(char, what) {
    this.space();
    if (this.text[this.at] !== char) throw new Mistake(this.at, `${what} was expected`);
    this.at++;
  }

  string(what) {
    this.space();
    const from = this.at;
    const raw = this.match(STRING);
    if (raw !== null) return raw;
    if (this.text[from] !== '"') throw new Mistake(from, `${what} was expected`);
    throw new Mistake(from, "this string does not end, or has a character in it that must be escaped");
  }

  /** depth: how many tokens of the wanted pointer lead to here; -1: it lies elsewhere. */
  value(depth, level, key) {
    if (level > DEPTH) throw new Mistake(this.at, "this is nested too deeply");
    this.space();
    const from = this.at, first = this.text[from];
    if (depth >= 0) this.note(depth, key, [from, from + 1]);
    const mine = this.found;
    if (first === "{") this.object(depth, level);
    else if (first === "[") this.array(depth, level);
    else if (first === '"') this.string("a string");
    else this.word();
    if (depth >= 0 && mine === this.found) this.found.value = [from, this.at];
  }

  /** Remembers the deepest place on the way to what is wanted. */
  note(depth, key, value) {
    this.found = { depth, key, value };
  }

  word() {
    const rest = this.text.slice(this.at, this.at + 5);
    const name = ["true", "false", "null"].find((one) => rest.startsWith(one));
    if (name) this.at += name.length;
    else if (this.match(NUMBER) === null) throw new Mistake(this.at, this.at < this.text.length ? "a value was expected" : "the text ends too early");
  }

  step(depth, token) {
    return depth >= 0 && depth < this.wanted.length && this.wanted[depth] === token ? depth + 1 : -1;
  }

  object(depth, level) {
    const names = new Set();
    this.at++;
    this.space();
    if (this.text[this.at] === "}") {
      this.at++;
      return;
    }
    for (;;) {
      this.space();
      const from = this.at, name = JSON.parse(this.string("a key in double quotes"));
      if (names.has(name)) throw new Mistake(from, `the key "${name}" stands here twice`);
      names.add(name);
      const key = [from, this.at];
      this.member(name, from, () => {
        this.expect(":", 'a ":"');
        this.value(this.step(depth, name), level + 1, key);
      });
      this.space();
      if (this.text[this.at] === "}") break;
      this.expect(",", 'a "," or "}"');
    }
    this.at++;
  }

  array(depth, level) {
    this.at++;
    this.space();
    if (this.text[this.at] === "]") {
      this.at++;
      return;
    }
    for (let i = 0; ; i++) {
      this.space();
      this.member(String(i), this.at, () => this.value(this.step(depth, String(i)), level + 1, null));
      this.space();
      if (this.text[this.at] === "]") break;
      this.expect(",", 'a "," or "]"');
    }
    this.at++;
  }
}

/**
 * Reads a text: {mistake: {at, message}}, or {range: [from, to]} of what the pointer names: its key where it has one,
 * otherwise its value; where there is no such thing, of the nearest thing around it.
 */
export function locate(text, pointer = "") {
  const wanted = pointer.split("/").slice(1).map((token) => token.replace(/~1/g, "/").replace(/~0/g, "~"));
  const reader = new Reader(text, wanted);
  try {
    reader.value(0, 0, null);
    reader.space();
    if (reader.at < text.length) throw new Mistake(reader.at, "something follows the end");
  } catch (mistake) {
    if (!(mistake instanceof Mistake)) throw mistake;
    return { mistake: { at: mistake.at, message: mistake.message } };
  }
  const { key, value } = reader.found;
  return { range: key || (value[1] - value[0] > 200 ? [value[0], value[0] + 1] : value) };
}

/** The tokens of the pointer to what an offset is in, as far as the text can be read: ["problem", "loads", "0"]. */
export function tokens_at(text, caret) {
  const reader = new Reader(text, [], caret);
  try {
    reader.value(-1, 0, null);
  } catch (mistake) {
    if (!(mistake instanceof Mistake)) throw mistake;
  }
  return reader.here || [];
}

/** {line, column}, both from 0, of an offset. */
export function place_of(text, at) {
  const before = text.slice(0, at), line = before.split("\n").length - 1;
  return { line, column: at - (before.lastIndexOf("\n") + 1) };
}

/** JSON text of a value for people: what is short stays on one line. */
export function pretty(value, indent = "", width = 96) {
  const flat = JSON.stringify(value, null, 1)?.replace(/\n\s*/g, " ").replace(/([[{]) /g, "$1").replace(/ ([\]}])/g, "$1");
  if (typeof value !== "object" || value === null || flat.length + indent.length <= width) return flat;
  const inner = `${indent}  `;
  if (Array.isArray(value) && value.every((one) => typeof one !== "object")) return fold(value, indent, inner, width);
  const parts = Array.isArray(value) ? value.map((one) => inner + pretty(one, inner, width))
    : Object.entries(value).map(([key, one]) => `${inner}${JSON.stringify(key)}: ${pretty(one, inner, width)}`);
  const [open, close] = Array.isArray(value) ? "[]" : "{}";
  return `${open}\n${parts.join(",\n")}\n${indent}${close}`;
}

/** A long list of numbers or words, as many on a line as fit. */
function fold(values, indent, inner, width) {
  const lines = [];
  let now = inner;
  values.forEach((value, i) => {
    const word = JSON.stringify(value) + (i + 1 < values.length ? ", " : "");
    if (now.length + word.length > width && now !== inner) {
      lines.push(now.trimEnd());
      now = inner;
    }
    now += word;
  });
  return `[\n${[...lines, now].join("\n")}\n${indent}]`;
}
