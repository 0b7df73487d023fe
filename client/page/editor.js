// editor.js: a new job as JSON text. Mistakes of JSON are found here, all others by the service, which checks the text
// without making a job (?validate=true), so that there is one set of rules.

import { idempotency_key } from "./api.js";
import { announce, debounce, h, show } from "./dom.js";
import { draft, EXAMPLES, example_text } from "./examples.js";
import { bytes, counted, seconds } from "./format.js";
import { matrices_form } from "./matrices.js";
import { locate, tokens_at } from "./json_locate.js";
import { help_of, path_words } from "./schema_help.js";
import { TextField } from "./text_field.js";

const CHECK_MS = 350, HELP_MS = 150;
const LONG = 500000; // characters: a text in which the place of the caret is not looked up all the time

function predicted_words(predicted) {
  if (!predicted) return "What it will take is not known beforehand.";
  return `${counted(predicted.d, "unknown")}, ${counted(predicted.m, "contact row")}, ${predicted.operator.replace("_", "-")} operator: about ` +
    `${seconds(predicted.seconds)} after the assembly and ${bytes(predicted.bytes)}${predicted.fits ? "" : ", more than this service may take"}.`;
}

class Editor {
  constructor(main, api) {
    Object.assign(this, { api, ends: new AbortController(), checking: null, key: idempotency_key(), place: null });
    this.field = new TextField({ label: "The job as JSON", id: "job-text", described_by: "verdict", on_input: (text) => this.changed(text) });
    this.verdict = h("div", { id: "verdict", class: "editor-verdict" });
    this.submit = h("button", { type: "submit", id: "submit", class: "primary" }, "Submit");
    this.examples = h("select", { id: "example", onchange: () => (location.hash = `#/new/${this.examples.value}`) },
      h("option", { value: "", disabled: true }, "choose"), EXAMPLES.map((one) => h("option", { value: one.name }, one.text)));
    this.check_soon = debounce(() => this.check(), CHECK_MS);
    this.preview_place = h("div", { class: "preview", id: "preview", hidden: true });
    this.help = h("p", { id: "key-help", class: "muted" });
    const help_soon = debounce(() => this.show_help(), HELP_MS);
    for (const event of ["keyup", "click", "input", "focus"]) this.field.area.addEventListener(event, help_soon);
    const file = h("input", { type: "file", id: "file", class: "unseen", accept: ".json,application/json",
      onchange: async () => file.files[0] && this.set(await file.files[0].text()) });
    const form = h("form", { onsubmit: (event) => (event.preventDefault(), this.send()) },
      h("div", { class: "title" }, h("h1", null, "New job")),
      h("div", { class: "editor-tools" }, h("label", { for: "example" }, "Start from"), this.examples,
        file, h("label", { for: "file", class: "button" }, "Open a file"), this.submit),
      this.verdict, matrices_form(api, (text) => this.set(text)), this.preview_place, this.field.element, this.help,
      h("p", { class: "muted" }, "Ctrl + Enter submits. Every key is explained in the ", h("a", { href: "/schemas/request.json" }, "schema"), "."));
    form.addEventListener("keydown", (event) => {
      if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) form.requestSubmit();
    });
    show(main, form);
  }

  /** An example comes late where the service is far: not over what was typed meanwhile, nor over another view's text. */
  async start(name) {
    const { key } = this, wanted = () => this.key === key && !this.ends.signal.aborted;
    try {
      if (EXAMPLES.some((one) => one.name === name)) this.examples.value = name;
      else this.examples.value = "";
      if (this.examples.value || !draft.get()) {
        this.examples.value = this.examples.value || EXAMPLES[0].name;
        const text = await example_text(this.examples.value);
        if (wanted()) this.set(text);
      } else this.set(draft.get());
    } catch (error) {
      if (wanted()) this.say("bad", error.message);
    }
  }

  /** What the schema says about the key that the caret is in. */
  async show_help() {
    const { text } = this.field;
    if (text.length > LONG) return;
    try {
      this.schema = this.schema || (await this.api.get("/schemas/request.json", { signal: this.ends.signal }));
    } catch {
      return; // it is only a help
    }
    const tokens = tokens_at(text, this.field.area.selectionStart), help = help_of(this.schema, tokens);
    const keys = (help || help_of(this.schema, tokens.slice(0, -1)))?.keys || [];
    show(this.help, tokens.length ? [h("code", null, path_words(tokens)), help ? `: ${help.text}` : ": not known to the schema.", " "] : null,
      keys.length ? [help ? "Keys: " : "Known here: ", keys.map((key, i) => [i ? ", " : "", h("code", null, key)])] : null);
  }

  set(text) {
    this.field.text = text;
    this.changed(text);
  }

  changed(text) {
    draft.set(text);
    this.key = idempotency_key();
    this.checking?.abort();
    this.field.unmark();
    this.say("muted", "Checking …");
    this.check_soon();
  }

  /** tone: "good", "bad", "muted". place: {line, column, at} of what is wrong. */
  say(tone, text, place = null) {
    this.place = place;
    this.verdict.className = `editor-verdict ${tone}`;
    show(this.verdict, place ? [h("button", { type: "button", class: "small", id: "go-there", onclick: () => this.field.put_caret(place.at) },
      `Line ${place.line}, column ${place.column}`), " "] : null, h("span", null, text));
    if (tone === "bad") announce(place ? `Line ${place.line}: ${text}` : text);
  }

  mistake(at, message, reveal) {
    const place = this.field.mark([at, at + 1], reveal);
    this.say("bad", `This is not JSON: ${message}.`, { ...place, at });
  }

  /** Shows what the service refused at the key that it is about. */
  refused(error, reveal) {
    const problem = error.problem || {};
    this.field.unmark();
    if (problem.mistakes) return void this.say_all(problem.mistakes);
    if (problem.pointer === undefined && problem.code !== "json_syntax") {
      this.say("bad", error.message);
      return;
    }
    const found = locate(this.field.text, problem.pointer || "");
    if (found.mistake) {
      this.mistake(found.mistake.at, found.mistake.message, reveal);
      return;
    }
    const place = this.field.mark(found.range, reveal);
    this.say("bad", problem.line ? `${error.message} (line ${problem.line} of the text there)` : error.message, { ...place, at: found.range[0] });
  }

  /** Several mistakes: a list, and a mark at each. */
  say_all(mistakes) {
    const places = mistakes.map((one) => {
      const { range } = locate(this.field.text, one.pointer);
      return { ...one, ...this.field.mark(range, false), at: range[0] };
    });
    this.say("bad", `${places.length} mistakes:`);
    this.verdict.append(h("ul", { class: "mistakes" }, places.map((one) => h("li", null,
      h("button", { type: "button", class: "small", onclick: () => this.field.put_caret(one.at) }, `Line ${one.line}, column ${one.column}`), " ", one.detail))));
  }

  /** Draws the scene, by code that is loaded then; without WebGL there is no picture of it. */
  async show_preview(text) {
    if (text.length > LONG) return;
    const request = JSON.parse(text);
    if (request?.problem?.kind !== "scene") return void (this.preview_place.hidden = true);
    this.preview_place.hidden = false;
    try {
      this.preview ??= import("./preview.js").then(({ Preview }) => new Preview(this.preview_place));
      const preview = await this.preview;
      if (this.ends.signal.aborted) preview.destroy();
      else preview.take(request);
    } catch {
      this.preview_place.hidden = true;
    }
  }

  async check() {
    const { text } = this.field;
    const found = locate(text);
    if (found.mistake) {
      this.mistake(found.mistake.at, found.mistake.message, false);
      return;
    }
    this.show_preview(text);
    this.checking?.abort();
    this.checking = new AbortController();
    const { signal } = this.checking;
    try {
      const { predicted } = await this.api.post("/v1/jobs?validate=true", text, { signal });
      if (signal.aborted || this.ends.signal.aborted) return;
      this.field.unmark();
      this.say(predicted && !predicted.fits ? "warn" : "good", `Valid. ${predicted_words(predicted)}`);
    } catch (error) {
      if (!signal.aborted && !this.ends.signal.aborted) this.refused(error, false);
    }
  }

  async send() {
    const { key } = this, { text } = this.field, found = locate(text);
    this.check_soon.cancel();
    this.checking?.abort();
    if (found.mistake) {
      this.mistake(found.mistake.at, found.mistake.message, true);
      return;
    }
    this.submit.disabled = true;
    try {
      const job = await this.api.post("/v1/jobs", text, { headers: { "Idempotency-Key": key } });
      if (!this.ends.signal.aborted) location.hash = `#/jobs/${job.id}`;
    } catch (error) {
      if (this.key === key && !this.ends.signal.aborted) this.refused(error, true); // else of another text
    }
    this.submit.disabled = false;
  }

  destroy() {
    this.ends.abort();
    this.checking?.abort();
    this.check_soon.cancel();
    this.preview?.then((one) => one.destroy(), () => {});
  }
}

export function show_editor(main, { api }, name) {
  const editor = new Editor(main, api);
  editor.start(name);
  return () => editor.destroy();
}
