// api.js: the service as the page uses it. Every request goes to the origin that the page came from. The token is sent
// in the Authorization header field and nowhere else: never in an address, so in no log and no history.

const UNSEEN_MS = 3000; // between two looks of a page that nobody sees

/** What the service refused; problem is its problem document (RFC 9457), or one made up where it sent none. */
export class ApiError extends Error {
  constructor(status, problem) {
    super(problem.detail || problem.title || `status ${status}`);
    this.name = "ApiError";
    this.status = status;
    this.problem = problem;
  }
}

/** As window.fetch. Of a lost connection browsers say little, and each something else. */
export async function ask_service(path, init) {
  try {
    return await fetch(path, init);
  } catch (error) {
    throw error instanceof TypeError ? new Error("The service does not answer. Is it still running?") : error;
  }
}

async function problem_of(response) {
  let problem = null;
  try {
    problem = await response.json();
  } catch {
    problem = null;
  }
  return new ApiError(response.status, problem && typeof problem === "object"
    ? problem : { title: response.statusText || `status ${response.status}`, code: "unknown" });
}

/**
 * The service.
 * options.token: () => the token or ""; options.ask: async (refused) => whether there is a new token, called on a 401,
 * once for all requests that wait.
 */
export function make_api({ token, ask }) {
  let asking = null, description = null;

  async function new_token(sent) {
    if (token() !== sent) return true; // another request asked meanwhile
    asking = asking || ask(sent !== "").finally(() => (asking = null));
    return asking;
  }

  /** As window.fetch, with the token; throws an ApiError where the status is 400 or more. */
  async function send(path, init = {}) {
    for (;;) {
      const sent = token();
      const headers = new Headers(init.headers || {});
      if (sent) headers.set("Authorization", `Bearer ${sent}`);
      const response = await ask_service(path, { ...init, headers, credentials: "omit", referrerPolicy: "no-referrer" });
      if (response.status === 401 && (await new_token(sent))) continue;
      if (!response.ok && response.status !== 304) throw await problem_of(response);
      return response;
    }
  }

  /**
   * Calls on_event({event, data, id}) for each Server-Sent Event until the stream ends or nobody sees the page any more,
   * and returns then: a browser has six connections to a service, and people have more tabs than that.
   */
  async function stream(path, { signal, last, on_event, on_open }) {
    if (document.hidden) await seen_again(signal);
    if (document.hidden || signal.aborted) return;
    const unseen = new AbortController(), leave = () => unseen.abort(), look = () => document.hidden && leave();
    signal.addEventListener("abort", leave);
    addEventListener("pagehide", leave);
    document.addEventListener("visibilitychange", look);
    try {
      await read_events(path, { signal: unseen.signal, last, on_event, on_open });
    } catch (error) {
      if (signal.aborted || !unseen.signal.aborted) throw error;
    } finally {
      signal.removeEventListener("abort", leave);
      removeEventListener("pagehide", leave);
      document.removeEventListener("visibilitychange", look);
    }
  }

  async function read_events(path, { signal, last, on_event, on_open }) {
    const headers = { Accept: "text/event-stream", ...(last ? { "Last-Event-ID": last } : {}) };
    const response = await send(path, { headers, signal, cache: "no-store" });
    if (response.status === 204 || !response.body) return;
    on_open?.();
    const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
    let rest = "";
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      const blocks = (rest + value).split(/\r?\n\r?\n/);
      rest = blocks.pop();
      for (const block of blocks) {
        const event = parse_event(block);
        if (event) on_event(event);
      }
    }
  }

  /** Whether the service has such a path: it describes itself, so that nothing need be tried in vain. */
  async function offers(path) {
    description = description || send("/openapi.json").then((response) => response.json());
    try {
      return path in (await description).paths;
    } catch (error) {
      description = null;
      throw error;
    }
  }

  return {
    fetch: send,
    offers,
    stream,
    get: async (path, init) => (await send(path, init)).json(),
    text: async (path, init) => (await send(path, init)).text(),
    blob: async (path, init) => (await send(path, init)).blob(),
    bytes: async (path, init) => (await send(path, init)).arrayBuffer(),
    /** text: the JSON text of the body. */
    post: async (path, text, init = {}) =>
      (await send(path, { ...init, method: "POST", body: text, headers: { "Content-Type": "application/json", ...init.headers } })).json(),
    remove: async (path) => {
      const response = await send(path, { method: "DELETE" });
      return response.status === 204 ? null : response.json();
    },
  };
}

/** Until the page is seen again, or some seconds have passed, or it is not wanted any more. */
function seen_again(signal) {
  return new Promise((resolve) => {
    const timer = setTimeout(done, UNSEEN_MS);
    function done() {
      clearTimeout(timer);
      document.removeEventListener("visibilitychange", done);
      signal.removeEventListener("abort", done);
      resolve();
    }
    document.addEventListener("visibilitychange", done);
    signal.addEventListener("abort", done);
  });
}

/** One block of an event stream (HTML, section 9.2.6); null: a comment. */
export function parse_event(block) {
  const event = { event: "message", data: [], id: "" };
  for (const line of block.split(/\r?\n/)) {
    const colon = line.indexOf(":");
    if (colon <= 0) continue;
    const value = line.slice(colon + 1).replace(/^ /, "");
    const name = line.slice(0, colon);
    if (name === "data") event.data.push(value);
    else if (name === "event" || name === "id") event[name] = value;
  }
  return event.data.length ? { ...event, data: event.data.join("\n") } : null;
}

/** A key under which a repeated submission makes no second job. */
export function idempotency_key() {
  return "page-" + Array.from(crypto.getRandomValues(new Uint8Array(16)), (b) => b.toString(16).padStart(2, "0")).join("");
}
