// A small client of the contact solver service: fetch and nothing else, so that it runs in Node 18 or later and in a
// page (the daemon's option --cors names the page's origin).
//
//   const service = new Uzawa("http://127.0.0.1:8080");
//   const job = await service.wait((await service.submit(request)).id);
//   const result = await service.result(job.id, ["reactions", "displacements"]);

const ENDED = ["successful", "failed", "dismissed"];
const pause = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));

const key = () => Array.from({ length: 32 }, () => Math.floor(16 * Math.random()).toString(16)).join("");

/** The service's reason (RFC 9457): problem has status, code, detail and a JSON pointer into the request. */
export class Refused extends Error {
  constructor(problem) {
    super(`${problem.pointer ?? ""} ${problem.detail ?? JSON.stringify(problem)}`.trim());
    this.problem = problem;
  }
}

export class Uzawa {
  constructor(server, { token, patience = 30 } = {}) {
    const environment = globalThis.process?.env ?? {};
    this.server = (server ?? environment.UZAWA_SERVER ?? "http://127.0.0.1:8080").replace(/\/$/, "");
    this.token = token ?? environment.UZAWA_TOKEN;
    this.patience = patience;
  }

  /** One request, sent again while the service cannot be reached or asks for patience. */
  async open(method, path, body, headers = {}) {
    const deadline = Date.now() + 1000 * this.patience;
    const options = { method, headers: { ...headers } };
    if (this.token) options.headers.Authorization = `Bearer ${this.token}`;
    if (body !== undefined) {
      options.body = JSON.stringify(body);
      options.headers["Content-Type"] = "application/json";
    }
    for (;;) {
      const reply = await fetch(this.server + path, options).catch((error) => error);
      const busy = reply instanceof Error || [429, 502, 503, 504].includes(reply.status);
      if (!busy && reply.ok) return reply;
      const once = method === "DELETE" && reply instanceof Error; // the first dismisses, a second would delete
      if (!busy || once || Date.now() > deadline) {
        if (reply instanceof Error)
          throw new Error(`no answer from ${this.server}: ${reply.cause?.message ?? reply.message}; is uzawad running there?`);
        throw new Refused(await reply.json().catch(() => ({ detail: `HTTP status ${reply.status}` })));
      }
      await pause(reply instanceof Error ? 0.5 : Number(reply.headers.get("retry-after") ?? 0.5));
    }
  }

  async call(...request) {
    return (await this.open(...request)).json();
  }

  /** Posts a job. The key makes a repeat after a lost connection the same job. */
  submit(request, wait = 0) {
    return this.call("POST", "/v1/jobs", request, { "Idempotency-Key": key(), ...(wait ? { Prefer: `wait=${wait}` } : {}) });
  }

  /** Long polls until the job has ended. */
  async wait(id) {
    let job = await this.call("GET", `/v1/jobs/${id}`);
    while (!ENDED.includes(job.status)) job = await this.call("GET", `/v1/jobs/${id}`, undefined, { Prefer: "wait=30" });
    if (job.status === "failed") throw new Refused(job.error);
    return job;
  }

  result(id, fields = ["summary"], name) {
    const query = new URLSearchParams({ fields: fields.join(","), ...(name ? { case: name } : {}) });
    return this.call("GET", `/v1/jobs/${id}/result?${query}`);
  }

  /** Certifies an answer from elsewhere; the result, whose summary has the certificate. */
  verify(request) {
    return this.call("POST", "/v1/verify", request, { "Idempotency-Key": key(), Prefer: "wait=60" });
  }

  /** Server-Sent Events as [name, data], until the job has ended. EventSource does the same where no token is needed. */
  async *events(id) {
    for (let last = "", status = ""; !ENDED.includes(status); ) {
      const reply = await this.open("GET", `/v1/jobs/${id}/events`, undefined, { "Last-Event-ID": last });
      let text = "";
      for await (const piece of reply.body.pipeThrough(new TextDecoderStream())) {
        const blocks = (text + piece).split("\n\n");
        text = blocks.pop();
        for (const block of blocks) {
          const fields = Object.fromEntries(block.split("\n").map((line) => line.split(/: (.*)/s)));
          if (!fields.data) continue; // a comment that keeps the connection alive
          last = fields.id ?? last;
          const data = JSON.parse(fields.data);
          status = data.status ?? status;
          yield [fields.event, data];
        }
      }
    }
  }
}
