// schema_help.js: what the schema of a request says about a key: the service's own words (/schemas/request.json).

const RULES = [
  ["enum", (value) => `one of ${value.map((one) => JSON.stringify(one)).join(", ")}`], ["minimum", (value) => `at least ${value}`],
  ["exclusiveMinimum", (value) => `greater than ${value}`], ["maximum", (value) => `at most ${value}`],
  ["exclusiveMaximum", (value) => `less than ${value}`], ["minItems", (value) => `at least ${value} of them`],
  ["maxItems", (value) => `at most ${value} of them`], ["default", (value) => `${JSON.stringify(value)} when left out`],
];
const BRANCHES = ["oneOf", "anyOf", "allOf"];

/** A schema and all that it refers to or offers, nearest first. */
function parts_of(root, schema, found = []) {
  if (!schema || typeof schema !== "object" || found.includes(schema)) return found;
  found.push(schema);
  if (schema.$ref?.startsWith("#/"))
    parts_of(root, schema.$ref.slice(2).split("/").reduce((at, token) => at?.[token], root), found);
  for (const name of BRANCHES) for (const one of schema[name] || []) parts_of(root, one, found);
  for (const name of ["then", "else"]) parts_of(root, schema[name], found);
  return found;
}

function child_of(part, token) {
  if (part.properties && Object.hasOwn(part.properties, token)) return part.properties[token];
  return /^\d+$/.test(token) && part.items ? part.items : null;
}

/** The schemas of what the tokens of a pointer lead to; none: it is not known. */
export function find_schema(root, tokens) {
  let now = [root];
  for (const token of tokens)
    now = now.flatMap((schema) => parts_of(root, schema)).map((part) => child_of(part, token)).filter((one) => one && typeof one === "object");
  return [...new Set(now)].flatMap((schema) => parts_of(root, schema));
}

/** {text, keys}: what is said about it, and the keys that it may have. */
export function help_of(root, tokens) {
  const parts = find_schema(root, tokens);
  if (!parts.length) return null;
  const said = parts.find((part) => part.description)?.description || parts.find((part) => part.title)?.title || "";
  const kinds = [...new Set(parts.flatMap((part) => part.type || []))];
  const rules = RULES.flatMap(([name, words]) => {
    const part = parts.find((one) => one[name] !== undefined);
    return part ? [words(part[name])] : [];
  });
  const keys = [...new Set(parts.flatMap((part) => Object.keys(part.properties || {})))];
  return { text: [said, [kinds.join(" or "), ...rules].filter(Boolean).join(", ")].filter(Boolean).join(" — "), keys: keys.slice(0, 40) };
}

/** "problem.loads[0]" */
export function path_words(tokens) {
  return tokens.map((token, i) => (/^\d+$/.test(token) ? `[${token}]` : `${i ? "." : ""}${token}`)).join("");
}
