import { byId, labelOf, make, makeSvg } from "./dom.js";
import { RampEditor, rampOf } from "./ramp.js";
import { fromHex, fromSlider, isTyped, numberOf, textOf, toHex, toSlider } from "./values.js";

/** Whether the lights of the settings are seen in what is shown. */
export const isLit = (what) => what === "cloud" || what === "wisps";

const kFormOfChoice = /[A-Z:]/;

/** The panel: a control for each option that the program names, and for each parameter of a script. */
export class Controls {
  #settings;
  #commit;
  #all = [];
  #search = byId("search");
  // For which the controls are shown.
  #view = "";

  constructor(settings, commit) {
    this.#settings = settings;
    this.#commit = commit;
    this.#search.addEventListener("input", () => this.#filter());
  }

  build({ groups, parameters }) {
    const state = new Map([...byId("groups").children].map((group) => [group.dataset.name, group.open]));
    this.#all = [];
    this.#settings.clearTable();
    const script = parameters.map((parameter) => ({
      ...parameter,
      verb: "parameters",
      type: { bool: "flag", float: "number", int: "count" }[parameter.type] ?? parameter.type,
      step: parameter.type === "int" ? 1 : undefined,
    }));
    const all = script.length ? [{ name: "Script", controls: script }, ...groups] : groups;
    byId("groups").replaceChildren(
      ...all.filter((group) => group.controls.length > 0).map((group) => {
        const isOpen = group.name === "Script" || group.controls.some((control) => control.first_day);
        const body = make("div", { class: "controls" });
        for (const control of group.controls) {
          this.#settings.table[control.verb][control.name] = control;
          const one = new Control(control, this.#settings, this.#commit);
          this.#all.push(one);
          body.append(one.element);
        }
        return make("details", { ".open": state.get(group.name) ?? isOpen, "data-name": group.name }, make("summary", {}, group.name, make("small")), body);
      }),
    );
    this.update();
    this.#filter();
  }

  update() {
    if (this.#view !== this.#settings.show.what) this.#filter();
    for (const control of this.#all) control.update();
    for (const group of byId("groups").children) {
      const changed = group.querySelectorAll(".control.changed:not([hidden])").length;
      group.querySelector("small").textContent = changed ? `${changed} set` : "";
    }
  }

  /** Sentences beside their controls; those that belong to none are returned. */
  showErrors(errors) {
    for (const control of this.#all) control.setError("");
    return errors.filter(({ verb, option, message }) => {
      const control = this.#all.find((one) => one.control.name === option && (!verb || one.control.verb === verb));
      if (!control) return true;
      control.setError(message.split("\n")[0]);
      const group = control.element.closest("details");
      group.open = true;
      return false;
    });
  }

  focusSearch() {
    this.#search.focus();
    this.#search.select();
  }

  #filter() {
    const words = this.#search.value.toLowerCase().split(/[\s-]+/).filter(Boolean);
    let found = 0;
    this.#view = this.#settings.show.what;
    for (const control of this.#all) {
      const views = control.control.views;
      const isFound = (!views || views.includes(this.#view)) && words.every((word) => control.words.includes(word));
      control.element.hidden = !isFound;
      found += isFound;
    }
    for (const group of byId("groups").children) {
      const isSeen = Boolean(group.querySelector(".control:not([hidden])"));
      group.hidden = !isSeen;
      if (words.length && isSeen) {
        group.dataset.was ??= String(group.open);
        group.open = true;
      } else if (!words.length && group.dataset.was) {
        group.open = group.dataset.was === "true";
        delete group.dataset.was;
      }
    }
    byId("none").hidden = found > 0;
    // Surfaces are shown in a light of their own.
    byId("dome").hidden = byId("angles").hidden = !isLit(this.#view);
    byId("light").hidden = words.length > 0;
  }
}

class Control {
  control;
  element;
  words;
  #settings;
  #commit;
  #error;
  #value;
  #parts = {};
  #ramp = null;
  #written = "";

  constructor(control, settings, commit) {
    this.control = control;
    this.#settings = settings;
    this.#commit = commit;
    this.words = `${control.name.replaceAll("-", " ")} ${control.name} ${control.help ?? ""}`.toLowerCase();
    const id = `${control.verb}-${control.name}`;
    const label = make("label", { for: id, title: `${control.help ?? ""}\nDouble click: ${control.default || "not set"}` }, labelOf(control.name));
    label.addEventListener("dblclick", () => this.#reset());
    this.#value = make("div", { class: "value" });
    this.#error = make("p", { class: "error", id: `${id}-error`, role: "alert" });
    const help = make("p", { class: "help", id: `${id}-help` }, control.help ?? "");
    this.element = make("div", { class: "control", "data-verb": control.verb, "data-name": control.name }, label, this.#value, help, this.#error);
    this.#build(id);
    for (const input of this.#value.querySelectorAll("input, select, textarea")) input.setAttribute("aria-describedby", `${id}-help ${id}-error`);
  }

  setError(message) {
    this.#error.textContent = message;
    for (const input of this.#value.querySelectorAll("input, select, textarea")) input.setAttribute("aria-invalid", Boolean(message));
  }

  /** Shows what the settings have. */
  update() {
    const { control } = this;
    const given = this.#settings.get(control.verb, control.name);
    this.element.classList.toggle("changed", given !== undefined);
    const isOff = (control.needs ?? []).some((name) => this.#settings.get(control.verb, name) === undefined);
    this.element.classList.toggle("off", isOff);
    for (const input of this.#value.querySelectorAll("input, select, textarea, button")) input.disabled = isOff;
    this.element.title = isOff ? `Needs ${control.needs.map(labelOf).join(", ")}` : "";
    const { text, range, color, box, choice, lines, curve } = this.#parts;
    const shown = given ?? this.#standard();
    // Not under the hand of somebody who types.
    if (text && (document.activeElement !== text || text.value === this.#written)) {
      text.value = this.#written = String(shown);
      text.title = String(shown).length > 8 ? String(shown) : "";
    }
    if (lines && document.activeElement !== lines) lines.value = (Array.isArray(given) ? given : given ? [given] : []).join("\n");
    if (choice) choice.value = given === undefined || String(given) === control.default ? "" : String(given);
    if (box) box.checked = given === undefined ? shown === "true" : given === true || given === "true";
    if (color) color.value = toHex(shown) ?? toHex(control.default) ?? "#808080";
    if (range) {
      const number = numberOf(shown);
      const fits = number && this.#fits(number);
      this.#value.classList.toggle("long", !fits && given !== undefined);
      range.value = toSlider(fits ? number.number : control.low, control);
      range.style.setProperty("--fill", `${range.value / 10}%`);
      range.setAttribute("aria-valuetext", String(shown));
    }
    if (curve) {
      const isRamp = rampOf(given) !== null;
      if (isRamp && !this.#ramp && given) curve.classList.add("used");
      if (this.#ramp && !this.#ramp.element.contains(document.activeElement)) this.#ramp.show(given, this.#flat());
    }
  }

  /** The default where it can be typed; else what says it goes to the placeholder. */
  #standard() {
    const { default: standard, type } = this.control;
    if (["number", "count", "length", "frequency", "percent"].includes(type)) return numberOf(standard) ? standard : "";
    return /[; ]/.test(standard ?? "") && type !== "vector" && type !== "color" ? "" : (standard ?? "");
  }

  /** Whether a number is in the unit of the control: of lengths in world units nothing is known here. */
  #fits({ number, unit }) {
    return unit === this.control.unit || !isTyped(this.control.unit) || number === 0;
  }

  #flat() {
    const { control } = this;
    const given = numberOf(this.#settings.get(control.verb, control.name));
    return (given && this.#fits(given) ? given.number : numberOf(control.default)?.number) ?? control.low ?? 1;
  }

  #put(value, hurry = false) {
    this.#settings.set(this.control.verb, { [this.control.name]: value }, hurry);
    if (!hurry) this.#commit();
  }

  #reset() {
    this.setError("");
    this.#put(undefined);
  }

  #build(id) {
    const { control } = this;
    if (control.type === "flag") return this.#flag(id);
    if (control.choices && !control.choices.some((choice) => kFormOfChoice.test(choice)) && !control.repeats) return this.#choice(id);
    if (control.repeats) return this.#lines(id);
    if (control.low !== undefined && control.high !== undefined && control.high > control.low) this.#slider();
    if (control.type === "color") this.#color();
    this.#text(id);
    if (control.is_field) this.#curve(id);
  }

  #flag(id) {
    const { control } = this;
    // A default that depends on something else is a third state.
    if (control.verb !== "parameters" && control.default && control.default !== "false") {
      const choice = make("select", { id }, make("option", { value: "" }, `default (${control.default})`), make("option", { value: "true" }, "on"), make("option", { value: "false" }, "off"));
      choice.addEventListener("change", () => this.#put(choice.value === "" ? undefined : choice.value === "true"));
      this.#parts.choice = choice;
      this.#value.append(choice);
      return;
    }
    const box = make("input", { type: "checkbox", id });
    box.addEventListener("change", () => {
      if (control.verb === "parameters") this.#put(String(box.checked) === control.default ? undefined : String(box.checked));
      else this.#put(box.checked || undefined);
    });
    this.#parts.box = box;
    this.#value.append(box);
  }

  #choice(id) {
    const { control } = this;
    const isNamed = control.choices.includes(control.default);
    const choice = make("select", { id }, make("option", { value: "" }, isNamed ? `${control.default} (default)` : control.default || "none"));
    for (const name of control.choices) if (name !== control.default) choice.append(make("option", { value: name }, name));
    choice.addEventListener("change", () => this.#put(choice.value || undefined));
    this.#parts.choice = choice;
    this.#value.append(choice);
  }

  #lines(id) {
    const { control } = this;
    const lines = make("textarea", { id, rows: 1, spellcheck: "false", placeholder: control.default || control.form || "one per line", title: control.form ?? "" });
    lines.addEventListener("change", () => this.#put(lines.value.split("\n").map((line) => line.trim()).filter(Boolean)));
    this.#parts.lines = lines;
    this.#value.append(lines);
  }

  #slider() {
    const { control } = this;
    const range = make("input", { type: "range", min: 0, max: 1000, step: 1, "aria-label": labelOf(control.name) });
    range.addEventListener("input", () => {
      range.style.setProperty("--fill", `${range.value / 10}%`);
      this.#put(textOf(fromSlider(Number(range.value), control), control), true);
    });
    range.addEventListener("change", () => this.#put(textOf(fromSlider(Number(range.value), control), control)));
    range.addEventListener("dblclick", () => this.#reset());
    // A thousandth of the slider is less than a step of some.
    range.addEventListener("keydown", (event) => {
      const way = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageUp: 5, PageDown: -5 }[event.key];
      if (!way) return;
      event.preventDefault();
      const now = numberOf(this.#settings.get(control.verb, control.name) ?? this.#standard())?.number;
      // Beyond the slider's end there is nowhere to go.
      if (way > 0 ? now >= control.high : now <= control.low) return;
      let place = Number(range.value);
      do place = Math.min(1000, Math.max(0, place + way * 10));
      while (place > 0 && place < 1000 && fromSlider(place, control) === now);
      this.#put(textOf(fromSlider(place, control), control));
    });
    this.#parts.range = range;
    this.#value.classList.add("slides");
    this.#value.append(range);
  }

  #color() {
    const color = make("input", { type: "color", "aria-label": `${labelOf(this.control.name)}, swatch` });
    color.addEventListener("input", () => this.#put(fromHex(color.value, this.control.default), true));
    color.addEventListener("change", () => this.#put(fromHex(color.value, this.control.default)));
    this.#parts.color = color;
    this.#value.append(color);
  }

  #text(id) {
    const { control } = this;
    const text = make("input", { type: "text", id, autocomplete: "off", spellcheck: "false", placeholder: control.default || control.form || "not set", title: control.form ?? "" });
    if (this.#parts.range && !control.is_field) text.inputMode = "decimal";
    if (control.choices) {
      text.setAttribute("list", `${id}-list`);
      this.#value.append(make("datalist", { id: `${id}-list` }, ...control.choices.map((value) => make("option", { value }))));
    }
    const take = () => {
      const typed = text.value.trim();
      const bare = numberOf(typed);
      const value = bare && bare.unit === "" && isTyped(control.unit) && this.#parts.range ? typed + control.unit : typed;
      // The printed default, too, is said where it is typed: a quality or a look may say something else.
      if (value !== String(this.#settings.get(control.verb, control.name) ?? "")) this.#put(value || undefined);
    };
    text.addEventListener("change", () => {
      take();
      setTimeout(() => this.update());
    });
    text.addEventListener("keydown", (event) => {
      if (event.key === "Escape") {
        text.value = String(this.#settings.get(control.verb, control.name) ?? this.#standard());
        text.blur();
      }
    });
    this.#parts.text = text;
    this.#value.append(text);
    if (this.#parts.range && control.unit && !isTyped(control.unit)) this.#value.append(make("span", { class: "unit" }, control.unit));
  }

  #curve(id) {
    const { control } = this;
    const icon = makeSvg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, makeSvg("path", { class: "line", d: "M4 18C10 18 10 6 20 6" }));
    const curve = make("button", { type: "button", class: "curve", "aria-expanded": "false", "aria-controls": `${id}-ramp`, "aria-label": `${labelOf(control.name)} by height`, title: "By height" }, icon);
    curve.addEventListener("click", () => {
      const isOpen = this.#ramp === null;
      curve.setAttribute("aria-expanded", String(isOpen));
      if (!isOpen) {
        this.#ramp.element.remove();
        this.#ramp = null;
        return;
      }
      this.#ramp = new RampEditor(control, (text, hurry) => this.#put(text, hurry));
      this.#ramp.element.id = `${id}-ramp`;
      this.#ramp.show(this.#settings.get(control.verb, control.name), this.#flat());
      this.#error.before(this.#ramp.element);
    });
    this.#parts.curve = curve;
    this.#value.append(curve);
  }
}
