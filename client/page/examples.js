// examples.js: bodies to start from. The bundler makes a file of each, fetched when it is chosen.

import { ask_service } from "./api.js";
import { pretty } from "./json_locate.js";
import paper from "../../tests/data/paper_body.json";
import bracket from "../examples/gallery/bracket.json";
import cylinder from "../examples/gallery/cylinder.json";
import gear from "../examples/gallery/gear.json";
import press_fit from "../examples/gallery/press_fit.json";

export const EXAMPLES = [
  { name: "paper", text: "The paper's body: a block on a rigid plane", file: paper },
  { name: "cylinder", text: "Cylinder on a plane: line contact of Hertz", file: cylinder },
  { name: "gear", text: "Soft block on a row of teeth", file: gear },
  { name: "bracket", text: "Bracket with a hole, from a Gmsh file", file: bracket },
  { name: "press_fit", text: "Press fit of two rings", file: press_fit },
];

/** The JSON text of an example. */
export async function example_text(name) {
  const example = EXAMPLES.find((one) => one.name === name);
  const response = await ask_service(example.file, { credentials: "omit" });
  if (!response.ok) throw new Error(`the example could not be loaded: status ${response.status}`);
  const text = await response.text();
  return text.trim().includes("\n") ? text.trimEnd() : pretty(JSON.parse(text));
}

let text_written = "";

/** What stands in the editor, kept while the page is open. */
export const draft = {
  get: () => text_written,
  set: (text) => (text_written = text),
};
