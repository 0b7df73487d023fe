// Solves the request in a file and says where it touches, how hard, and how sure that is.
// usage: node submit_and_wait.mjs REQUEST.json     exit status 0: certified as asked, and every assertion passes
import { readFile } from "node:fs/promises";
import { Uzawa } from "../../javascript/uzawa.mjs";

const [path] = process.argv.slice(2);
if (!path) {
  console.error("usage: node submit_and_wait.mjs REQUEST.json");
  process.exit(2);
}
const service = new Uzawa();
const { id } = await service.submit(JSON.parse(await readFile(path, "utf8")), 10);
const { summary } = await service.wait(id);
const { contact, certificate } = summary;
console.log(`${summary.outcome}: ${contact.active} of ${contact.candidates} points touch`);
if (contact.max_pressure_at) console.log(`largest pressure ${contact.max_pressure} at node ${contact.max_pressure_at.node}`);
console.log(`the exact displacements are within ${certificate.relative_error} of these (relative, energy norm)`);
for (const line of summary.assertions ?? [])
  console.log(`${line.result}: ${line.name ?? line.quantity} = ${line.value} ${line.reason ?? ""}`);
process.exitCode = summary.outcome === "converged" && summary.assertions_passed !== false ? 0 : 1;
