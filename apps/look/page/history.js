const kMost = 200;

/** What was, and what was undone, each as text. */
export class History extends EventTarget {
  #past = [];
  #future = [];
  #now = "";

  /** Forgets all and begins here. */
  begin(state) {
    this.#past = [];
    this.#future = [];
    this.#now = JSON.stringify(state);
    this.#changed();
  }

  /** Remembers a finished change; nothing where nothing is other. */
  add(state) {
    const text = JSON.stringify(state);
    if (text === this.#now) return;
    this.#past.push(this.#now);
    if (this.#past.length > kMost) this.#past.shift();
    this.#future = [];
    this.#now = text;
    this.#changed();
  }

  undo() {
    return this.#step(this.#past, this.#future);
  }

  redo() {
    return this.#step(this.#future, this.#past);
  }

  get canUndo() {
    return this.#past.length > 0;
  }

  get canRedo() {
    return this.#future.length > 0;
  }

  #step(from, to) {
    if (from.length === 0) return null;
    to.push(this.#now);
    this.#now = from.pop();
    this.#changed();
    return JSON.parse(this.#now);
  }

  #changed() {
    this.dispatchEvent(new Event("change"));
  }
}
