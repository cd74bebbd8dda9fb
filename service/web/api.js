// Requests to the server: its key, its problems, and patience where it asks for some.

const KEY = "lfd-key";
const MOST_TRIES = 5;

/** What the server says went wrong (RFC 9457); field: the part of the request at fault. */
export class Problem extends Error {
  constructor({ detail, title, field }, status = 0) {
    super(detail ?? title ?? "something went wrong");
    this.field = field ?? null;
    this.status = status;
  }
}

/**
 * Ask the server; the Response, once it is a good one. Throws Problem, or AbortError once the
 * signal is given. A key is asked for where one is needed, and a busy server is asked again.
 */
export async function ask(path, { method = "GET", json, body, accept, signal } = {}) {
  for (let tries = 1; ; tries += 1) {
    const headers = {};
    const key = sessionStorage.getItem(KEY);
    if (key) headers["X-API-Key"] = key;
    if (accept) headers.Accept = accept;
    if (json !== undefined) headers["Content-Type"] = "application/json";
    const sent = json === undefined ? body : JSON.stringify(json);
    const response = await fetch(path, { method, headers, body: sent, signal }).catch((error) => {
      if (error.name === "AbortError") throw error;
      throw new Problem({ detail: "The server does not answer. Is it running?" });
    });
    if (response.ok) return response;
    const problem = new Problem(await told(response), response.status);
    if (problem.status === 401) {
      await askKey(key ? "This key is not one of the server's." : "This server asks for an API key.");
    } else if (tries < MOST_TRIES && [429, 503].includes(problem.status)) {
      await pause(Math.min(Number(response.headers.get("Retry-After")) || 1, 30), signal);
    } else {
      throw problem;
    }
  }
}

async function told(response) {
  const title = `${response.status} ${response.statusText}`;
  try {
    return { title, ...(await response.json()) };
  } catch {
    return { title };
  }
}

function pause(seconds, signal) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(resolve, 1000 * seconds);
    signal?.addEventListener("abort", () => {
      clearTimeout(timer);
      reject(signal.reason);
    });
  });
}

let asking = null;

/** Ask a person for the key, once however many requests need it. */
function askKey(reason) {
  asking ??= new Promise((resolve, reject) => {
    const dialog = document.createElement("dialog");
    dialog.className = "card";
    dialog.innerHTML = `
      <form method="dialog">
        <h2>API key</h2>
        <p></p>
        <label>Key <input type="password" name="key" autocomplete="off" required></label>
        <p class="note">It is kept until this tab closes.</p>
        <div class="row"><button class="primary" value="use">Use it</button></div>
      </form>`;
    dialog.querySelector("p").textContent = reason;
    dialog.addEventListener("close", () => {
      const key = new FormData(dialog.firstElementChild).get("key");
      dialog.remove();
      asking = null;
      if (dialog.returnValue !== "use") {
        reject(new Problem({ detail: "Without a key the server answers nothing.", field: "key" }));
        return;
      }
      sessionStorage.setItem(KEY, key);
      resolve();
    });
    document.body.append(dialog);
    dialog.showModal();
  });
  return asking;
}

/**
 * Newest wins: one thing is made at a time, what is wanted next waits for it, and of what waits only
 * the newest is made. What is being made is called off once it is stale.
 */
export class Newest {
  #work;
  #stale;
  #busy;
  #failed;
  #wanted = null;
  #running = null;

  /**
   * work(wanted, signal): makes something and shows it. stale(running, wanted): whether to call it
   * off. busy(is): is told when work begins and ends. failed(error, wanted): what to do then.
   */
  constructor(work, { stale = () => true, busy = () => {}, failed = () => {} } = {}) {
    this.#work = work;
    this.#stale = stale;
    this.#busy = busy;
    this.#failed = failed;
  }

  want(wanted) {
    this.#wanted = { wanted };
    if (!this.#running) this.#go();
    else if (this.#stale(this.#running.wanted, wanted)) this.#running.controller.abort();
  }

  stop() {
    this.#wanted = null;
    this.#running?.controller.abort();
  }

  async #go() {
    this.#busy(true);
    while (this.#wanted) {
      const now = { ...this.#wanted, controller: new AbortController() };
      this.#wanted = null;
      this.#running = now;
      try {
        await this.#work(now.wanted, now.controller.signal);
      } catch (error) {
        if (!now.controller.signal.aborted) this.#failed(error, now.wanted);
      }
      this.#running = null;
    }
    this.#busy(false);
  }
}

/** Milliseconds by span of an answer's Server-Timing header. */
export function timings(response) {
  const spans = {};
  for (const part of (response.headers.get("Server-Timing") ?? "").split(",")) {
    const [name, ...parameters] = part.trim().split(";");
    const duration = parameters.find((parameter) => parameter.startsWith("dur="));
    if (duration) spans[name] = Number(duration.slice(4));
  }
  return spans;
}

/** Hand a blob to the person as a file. */
export function save(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
