// view_order.js: the rows of the list as one asks for them: those that hold the words searched for, in an order.

/** Columns that one may sort by: the value of a row, text or a number; null goes last whichever way. */
const KEYS = {
  state: (row) => row.state,
  title: (row) => row.title.toLowerCase(),
  error: (row) => row.error,
  problem: (row) => row.d,
  time: (row) => row.total,
  created: (row) => row.created,
};

/** All that can be searched of a row. */
function text_of(row) {
  return `${row.id} ${row.name} ${row.state} ${row.result} ${row.kind || ""} ${row.tags.join(" ")} ${row.created}`.toLowerCase();
}

/** Is this the order in which the jobs come, and all of them? */
export function is_plain({ words, by, up }) {
  return !words && by === "created" && !up;
}

/** rows newest first, as they come. order: {words, by, up}; every word must be found. */
export function arrange(rows, order) {
  if (is_plain(order)) return rows;
  const wanted = order.words.toLowerCase().split(/\s+/).filter(Boolean), key = KEYS[order.by];
  const found = wanted.length ? rows.filter((row) => wanted.every((word) => text_of(row).includes(word))) : [...rows];
  if (order.by === "created") return order.up ? found.reverse() : found;
  return sorted_by(found, key, order.up);
}

/** A copy in the order of key(item), text or a number; null goes last whichever way. */
export function sorted_by(items, key, up) {
  const values = new Map(items.map((item) => [item, key(item)])), way = up ? 1 : -1;
  return [...items].sort((a, b) => {
    const [x, y] = [values.get(a), values.get(b)];
    if (x === null || y === null) return (x === null) - (y === null);
    return x === y ? 0 : x < y ? -way : way;
  });
}
