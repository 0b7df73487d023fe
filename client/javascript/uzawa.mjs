// Client of the contact solver service: fetch and nothing else, so that it runs in Node 18 or later and in a page (the
// daemon's option --cors names the page's origin). Its types are in uzawa.d.mts.
//
//   const service = new Uzawa("http://127.0.0.1:8080");
//   const job = await service.solve(request);
//   const { reactions, displacements } = await service.result(job.id, ["reactions", "displacements"]);

const ENDED = ["successful", "failed", "dismissed"];
const pause = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));

const key = () => Array.from({ length: 32 }, () => Math.floor(16 * Math.random()).toString(16)).join("");

const of = (name, query) => new URLSearchParams({ ...query, ...(name ? { case: name } : {}) });

/** The service's reason (RFC 9457): problem has status, code, detail and a JSON pointer into the request. */
export class Refused extends Error {
  constructor(problem) {
    const { pointer = "", detail = JSON.stringify(problem) } = problem;
    super(detail.startsWith(pointer) ? detail : `${pointer} ${detail}`); // details begin with the place where they can
    this.name = "Refused";
    this.problem = problem;
  }
}

export class Uzawa {
  /** Of a server, default $UZAWA_SERVER; token: $UZAWA_TOKEN; patience: seconds for which a request is sent again. */
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
    if (body instanceof Blob) options.body = body;
    else if (body !== undefined) {
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

  /** Submits a request and waits for its answer; progress is called with the data of each event. Refused where the request
   * is refused or the job fails. */
  async solve(request, progress) {
    const { id } = await this.submit(request, progress ? 0 : 10);
    return this.wait(id, progress);
  }

  /** Posts a job. The key makes a repeat after a lost connection the same job. */
  submit(request, wait = 0) {
    return this.call("POST", "/v1/jobs", request, { "Idempotency-Key": key(), ...(wait ? { Prefer: `wait=${wait}` } : {}) });
  }

  /** Checks a request without solving it, and predicts what it costs. */
  validate(request) {
    return this.call("POST", "/v1/jobs?validate=true", request);
  }

  job(id) {
    return this.call("GET", `/v1/jobs/${id}`);
  }

  /** The newest first: status, tag, since, until, order, limit. */
  async jobs(query = {}) {
    return (await this.call("GET", `/v1/jobs?${new URLSearchParams(query)}`)).jobs;
  }

  /** Until the job has ended: by its events where there is somebody to tell, else by long polls. */
  async wait(id, progress) {
    let job = await this.job(id);
    if (progress && !ENDED.includes(job.status)) {
      for await (const [event, data] of this.events(id)) if (event === "progress") progress(data);
      job = await this.job(id);
    }
    while (!ENDED.includes(job.status)) job = await this.call("GET", `/v1/jobs/${id}`, undefined, { Prefer: "wait=30" });
    if (job.status === "failed") throw new Refused(job.error);
    return job;
  }

  /** Fields of the answer; name: of one load case. */
  result(id, fields = ["summary"], name) {
    return this.call("GET", `/v1/jobs/${id}/result?${of(name, { fields: fields.join(",") })}`);
  }

  /** The convergence history: an array for each column, a number for each iteration. */
  async history(id, name) {
    for (let columns = [], rows = []; ; ) {
      const after = rows.length ? { after: rows.at(-1)[0] } : {}; // in parts, until nothing is behind the last iteration
      const part = await this.call("GET", `/v1/jobs/${id}/history?${of(name, after)}`);
      columns = part.columns;
      rows = rows.concat(part.rows);
      if (!part.rows.length) return Object.fromEntries(columns.map((column, i) => [column, rows.map((row) => row[i])]));
    }
  }

  /** SVG: "deformed" (colour, factor, width, view, up, case), "convergence" (x, theme, width, case) or "whole-error". */
  async picture(id, kind = "deformed", query = {}) {
    return (await this.open("GET", `/v1/jobs/${id}/${kind}.svg?${new URLSearchParams(query)}`)).text();
  }

  /** Stops a job, or takes it out of the queue; the best answer so far stays. */
  async dismiss(id) {
    if (!ENDED.includes((await this.job(id)).status)) await this.open("DELETE", `/v1/jobs/${id}`);
  }

  /** Sends a mesh or a matrix once: {upload: ID}, which stands for its text in a request. */
  async upload(data) {
    const reply = await this.open("POST", "/v1/uploads", new Blob([data]), { "Content-Type": "application/octet-stream" });
    return { upload: (await reply.json()).id };
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
