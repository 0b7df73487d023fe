// Watches a job while it runs, by Server-Sent Events.
// usage: node watch.mjs REQUEST.json [SECONDS]     it is dismissed after so many seconds, with its best answer so far
import { readFile } from "node:fs/promises";
import { Uzawa } from "../../javascript/uzawa.mjs";

const [path, seconds] = process.argv.slice(2);
if (!path) {
  console.error("usage: node watch.mjs REQUEST.json [SECONDS]");
  process.exit(2);
}
const service = new Uzawa();
let job = await service.submit(JSON.parse(await readFile(path, "utf8")));
const timer = seconds && setTimeout(() => service.open("DELETE", `/v1/jobs/${job.id}`), 1000 * Number(seconds));
for await (const [event, data] of service.events(job.id)) {
  if (event === "status") {
    job = data;
    console.log(data.status);
  } else if (data.iteration !== undefined)
    console.log(`${data.progress} %  iteration ${data.iteration}  error at most ${data.error_bound}`);
}
clearTimeout(timer);
if (job.summary) console.log(`${job.summary.outcome}: error at most ${job.summary.certificate.absolute_error}`);
process.exitCode = job.summary ? 0 : 1;
