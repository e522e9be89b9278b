import { byId, labelOf, make } from "./dom.js";
import { kPage, post } from "./stream.js";
import { fromSlider, isTyped, numberOf, textOf, toSlider } from "./values.js";

// What the rows are of until somebody says so.
const kFirst = { wisps: "wisps clump", pieces: "cut random-planes", transfer: "transfer checker" };

/** The dialog in which pictures for several values of one or two options stand side by side; a click takes those of one. */
export class Wedge {
  #settings;
  #commit;
  #body;
  #axes = [];
  // For which the axes are.
  #view = "";
  #revision = 0;
  #cells = [];
  #addresses = [];

  /** body() gives show and so on; size() the size of the picture. */
  constructor(settings, commit, body) {
    this.#settings = settings;
    this.#commit = commit;
    this.#body = body;
    byId("open-wedge").addEventListener("click", () => this.#open());
    byId("wedge-make").addEventListener("click", () => this.#make());
  }

  #open() {
    if (this.#view !== this.#settings.show.what) this.reset();
    this.#view = this.#settings.show.what;
    if (this.#axes.length === 0) this.#axes = [this.#axis("Rows", kFirst[this.#view] ?? "cloud amplitude"), this.#axis("Columns", "")];
    byId("wedge").showModal();
  }

  /** After other controls have come. */
  reset() {
    this.#axes = [];
    byId("wedge-axes").replaceChildren();
  }

  #axis(title, first) {
    const select = make("select", { "aria-label": `${title}: option` });
    if (!first) select.append(make("option", { value: "" }, "none"));
    for (const [verb, controls] of Object.entries(this.#settings.table))
      for (const control of Object.values(controls))
        if ((control.views ?? [this.#view]).includes(this.#view) && !["flag", "file"].includes(control.type) && !control.repeats && !["view", "camera-position", "look-at", "up"].includes(control.name))
          select.append(make("option", { value: `${verb} ${control.name}` }, labelOf(control.name)));
    const values = make("input", { "aria-label": `${title}: values, with commas between them`, placeholder: "values, with commas between them, or ; where they have commas", autocomplete: "off", spellcheck: "false" });
    const suggest = () => {
      const control = this.#control(select.value);
      const suggested = control ? this.#suggested(control) : [];
      values.value = suggested.some((value) => value.includes(",")) ? `${suggested.join("; ")};` : suggested.join(", ");
      values.disabled = !control;
    };
    select.addEventListener("change", suggest);
    const wanted = [...select.options].find((option) => option.value === first);
    if (wanted) select.value = wanted.value;
    suggest();
    byId("wedge-axes").append(make("div", { class: "axis" }, make("span", { class: "muted" }, title), select, values));
    return { select, values };
  }

  #control(value) {
    const [verb, name] = value.split(" ");
    return name ? this.#settings.table[verb][name] : null;
  }

  #suggested(control) {
    if (control.choices) return control.choices.filter((choice) => !/[A-Z:]/.test(choice));
    if (control.low === undefined) return [control.default].filter(Boolean);
    const now = numberOf(this.#settings.get(control.verb, control.name)) ?? numberOf(control.default);
    const middle = now ? toSlider(now.number, control) : 500;
    const places = [middle * 0.4, middle, middle + (1000 - middle) * 0.3, middle + (1000 - middle) * 0.6];
    return [...new Set(places.map((place) => textOf(fromSlider(Math.round(place), control), control)))];
  }

  #read({ select, values }) {
    const control = this.#control(select.value);
    if (!control) return null;
    // Semicolons part what has commas, as on the command line.
    const parts = values.value.split(values.value.includes(";") ? ";" : ",").map((value) => value.trim()).filter(Boolean);
    const texts = parts.map((value) => (isTyped(control.unit) && numberOf(value)?.unit === "" ? value + control.unit : value));
    return { verb: control.verb, option: control.name, values: texts };
  }

  async #make() {
    const [rows, columns] = this.#axes.map((axis) => this.#read(axis));
    byId("wedge-error").textContent = "";
    if (!rows || rows.values.length === 0) return;
    const isPair = columns && columns.values.length > 0;
    const body = this.#body();
    // As a control takes away what it excludes.
    for (const { verb, option } of isPair ? [rows, columns] : [rows])
      for (const other of this.#settings.table[verb][option].excludes ?? []) delete body.settings[verb][other];
    const width = 320, height = Math.max(16, Math.round((width * body.size[1]) / body.size[0]));
    const across = isPair ? columns.values.length : Math.min(rows.values.length, window.innerWidth < 760 ? 2 : 4);
    const sheet = byId("wedge-sheet");
    sheet.style.gridTemplateColumns = `repeat(${across}, minmax(0, 1fr))`;
    for (const address of this.#addresses) URL.revokeObjectURL(address);
    this.#addresses = [];
    this.#cells = rows.values.flatMap((row) =>
      (isPair ? columns.values : [null]).map((column) => {
        const label = make("span", {}, `${labelOf(rows.option)} ${row}${column === null ? "" : `, ${labelOf(columns.option).toLowerCase()} ${column}`}`);
        const blank = make("div", { class: "blank", style: `aspect-ratio: ${width} / ${height}` });
        const button = make("button", { type: "button", title: "Take these values" }, blank, label);
        button.addEventListener("click", () => {
          this.#settings.set(rows.verb, { [rows.option]: row });
          if (column !== null) this.#settings.set(columns.verb, { [columns.option]: column });
          this.#commit();
          byId("wedge").close();
        });
        return button;
      }),
    );
    sheet.replaceChildren(...this.#cells);
    byId("wedge-state").textContent = `0 of ${this.#cells.length}`;
    try {
      await post("wedge", { page: kPage, revision: ++this.#revision, ...body, size: [width, height], rows, columns: isPair ? columns : null });
    } catch (error) {
      byId("wedge-error").textContent = error.message;
      sheet.replaceChildren();
      byId("wedge-state").textContent = "";
    }
  }

  take({ revision, index, count, mime, label, error }, payload) {
    const cell = this.#cells[index];
    if (revision !== this.#revision || !cell) return;
    if (error) {
      cell.firstChild.textContent = error;
      cell.firstChild.classList.add("error");
    } else {
      const address = URL.createObjectURL(new Blob([payload], { type: mime }));
      this.#addresses.push(address);
      cell.firstChild.replaceWith(make("img", { src: address, alt: label }));
    }
    cell.dataset.done = "";
    const done = this.#cells.filter((one) => "done" in one.dataset).length;
    byId("wedge-state").textContent = done === count ? "Click a picture to take its values." : `${done} of ${count}`;
  }
}
