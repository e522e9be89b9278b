export const clone = (value) => JSON.parse(JSON.stringify(value));
const empty = () => ({ cloud: {}, wisps: {}, cut: {}, transfer: {}, render: {}, parameters: {} });
const whole = (settings) => ({ ...empty(), ...clone(settings ?? {}) });

// Of options that have no controls.
const kNeeds = { render: { frame: ["camera"], "rotation-order": ["camera"] } };

/**
 * What is looked at: settings of the verbs and what of the picture is shown. "change" is sent for each change, with `hurry` while
 * something is dragged.
 */
export class Settings extends EventTarget {
  values = whole({});
  show = { what: "cloud", layer: "beauty", false_color: false };
  /** verb -> name -> control */
  table = empty();

  get(verb, name) {
    return this.values[verb][name];
  }

  /** Sets values, of which undefined is the default; those that exclude them go, and those that need what goes. */
  set(verb, values, hurry = false) {
    const own = this.values[verb];
    for (const [name, value] of Object.entries(values)) {
      if (value === undefined || value === "" || (Array.isArray(value) && value.length === 0)) {
        delete own[name];
        continue;
      }
      own[name] = value;
      for (const other of this.table[verb][name]?.excludes ?? []) delete own[other];
    }
    this.#dropUnfounded(verb);
    this.#changed(hurry);
  }

  replace(values, show = {}) {
    this.values = whole(values);
    Object.assign(this.show, show);
    this.#changed(false);
  }

  setShow(values) {
    Object.assign(this.show, values);
    this.#changed(false);
  }

  /** Forgets the controls that there were. */
  clearTable() {
    this.table = empty();
  }

  copy() {
    return clone(this.values);
  }

  /** Takes away what needs something that is not there. */
  #dropUnfounded(verb) {
    const own = this.values[verb];
    const needsOf = (name) => kNeeds[verb]?.[name] ?? this.table[verb][name]?.needs ?? [];
    const isUnfounded = (name) => needsOf(name).some((other) => own[other] === undefined);
    if (verb === "render" && own.projection !== "orthographic") delete own["orthographic-width"];
    for (let name; (name = Object.keys(own).find(isUnfounded)); ) delete own[name];
  }

  #changed(hurry) {
    this.dispatchEvent(new CustomEvent("change", { detail: { hurry } }));
  }
}

/** Settings as the part of an address after #. */
export function toFragment(state) {
  const bytes = new TextEncoder().encode(JSON.stringify(state));
  return btoa(String.fromCharCode(...bytes)).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** The opposite; null where it is none. */
export function fromFragment(fragment) {
  try {
    const text = atob(fragment.replace(/^#/, "").replaceAll("-", "+").replaceAll("_", "/"));
    const state = JSON.parse(new TextDecoder().decode(Uint8Array.from(text, (c) => c.charCodeAt(0))));
    return state && typeof state === "object" && state.settings ? state : null;
  } catch {
    return null;
  }
}
