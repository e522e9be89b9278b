export const kPage = Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => "abcdefghijklmnopqrstuvwxyz012345"[byte % 32]).join("");

/** An answer other than 200, with the sentences that came with it. */
export class Refused extends Error {
  constructor(status, errors) {
    super(errors.map((error) => error.message).join("\n") || `the program answered ${status}`);
    this.errors = errors;
    this.status = status;
  }
}

async function answered(response) {
  let body = null;
  try {
    body = await response.json();
  } catch {
    body = null;
  }
  if (!response.ok) throw new Refused(response.status, body?.errors ?? []);
  return body;
}

export const get = async (path) => answered(await fetch(path, { cache: "no-store" }));

export const post = async (path, body) =>
  answered(await fetch(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) }));

const wait = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

// Without the empty message that comes every 5 s the other end is gone.
const kSilence = 16000;

/**
 * What comes from the program: "message" with its JSON and payload; "connection" with state open, lost or gone. Tries again each second
 * where it breaks.
 */
export class Stream extends EventTarget {
  async run() {
    for (;;) {
      try {
        const isGone = await this.#read();
        this.#say(isGone ? "gone" : "lost");
      } catch {
        this.#say("lost");
      }
      await wait(1000);
    }
  }

  #say(state) {
    this.dispatchEvent(new CustomEvent("connection", { detail: state }));
  }

  async #read() {
    const abort = new AbortController();
    let silence = setTimeout(() => abort.abort(), kSilence);
    try {
      const response = await fetch(`stream?page=${kPage}`, { cache: "no-store", signal: abort.signal });
      if (response.status === 404) return true;
      if (!response.ok) return false;
      this.#say("open");
      const reader = response.body.getReader();
      let bytes = new Uint8Array(0);
      for (;;) {
        const { done, value } = await reader.read();
        if (done) return false;
        clearTimeout(silence);
        silence = setTimeout(() => abort.abort(), kSilence);
        const all = new Uint8Array(bytes.length + value.length);
        all.set(bytes);
        all.set(value, bytes.length);
        bytes = all.subarray(this.#take(all));
      }
    } finally {
      clearTimeout(silence);
      abort.abort();
    }
  }

  /** Sends the whole messages on; the number of bytes they were. */
  #take(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    let at = 0;
    while (at + 8 <= bytes.length) {
      const json = view.getUint32(at, true), payload = view.getUint32(at + 4, true);
      const begin = at + 8, end = begin + json + payload;
      if (end > bytes.length) break;
      if (json > 0) {
        const message = JSON.parse(new TextDecoder().decode(bytes.subarray(begin, begin + json)));
        this.dispatchEvent(new CustomEvent("message", { detail: { message, payload: bytes.slice(begin + json, end) } }));
      }
      at = end;
    }
    return at;
  }
}

// While dragging, the next settings wait for the picture of the last ones: else nothing slower than the hand would ever be seen.
const kLongestWait = 4000;

/** Sends settings: one request at a time, the latest wins, and only pictures of the latest are current. */
export class Sender extends EventTarget {
  #makeBody;
  #wanted = null;
  #isSending = false;
  #shownBy = 0;
  #timer = 0;
  #good = 0;
  #held = [];
  #last = 0;
  #isHurried = false;
  revision = 0;

  constructor(makeBody) {
    super();
    this.#makeBody = makeBody;
  }

  ask(hurry) {
    this.#wanted = { hurry };
    this.#pump();
  }

  /** Whether something newer waits or is on its way. */
  get isBehind() {
    return this.#wanted !== null || this.#isSending;
  }

  /** Whether the last settings were sent while something was dragged. */
  get isHurried() {
    return this.#isHurried;
  }

  /** True for a message about the settings as they are; of one that may become it again, when new ones are refused, a later call is made. */
  isCurrent(revision, again) {
    if (revision === this.revision) return true;
    if (this.#isSending && revision === this.#good) this.#held.push(again);
    return false;
  }

  /** A picture, an end or an error of this revision came. */
  seen(revision) {
    if (revision !== this.revision) return;
    this.#shownBy = 0;
    this.#pump();
  }

  async #pump() {
    clearTimeout(this.#timer);
    if (this.#isSending || !this.#wanted) return;
    const { hurry } = this.#wanted;
    const left = this.#shownBy - performance.now();
    if (hurry && left > 0) {
      this.#timer = setTimeout(() => this.#pump(), left);
      return;
    }
    this.#wanted = null;
    this.#isSending = true;
    this.#isHurried = hurry;
    this.revision = ++this.#last;
    this.#held = [];
    this.#shownBy = performance.now() + kLongestWait;
    const body = { page: kPage, revision: this.revision, hurry, ...this.#makeBody() };
    try {
      await post("settings", body);
      this.#good = body.revision;
      this.#isSending = false;
      this.dispatchEvent(new CustomEvent("taken", { detail: body }));
    } catch (error) {
      this.#isSending = false;
      this.#shownBy = 0;
      if (error instanceof Refused) {
        this.revision = this.#good;
        for (const again of this.#held) again();
        this.dispatchEvent(new CustomEvent("refused", { detail: error }));
      }
    }
    this.#pump();
  }
}
