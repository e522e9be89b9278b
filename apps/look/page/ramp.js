import { follow, makeSvg, make, short } from "./dom.js";

const kWidth = 300, kHeight = 110, kEdge = 10;
const kForm = /^height:((?:-?[\d.]+=-?[\d.eE+-]+[a-z%]*,?)+)$/;

/** Points of "height:AT=VALUE,..." with the values' unit; null for other texts. */
export function rampOf(text) {
  const found = kForm.exec(text ?? "");
  if (!found) return null;
  let unit = "";
  const points = found[1].split(",").filter(Boolean).map((pair) => {
    const [at, value] = pair.split("=");
    unit = /[a-z%]*$/.exec(value)[0] || unit;
    return { at: Number(at), value: parseFloat(value) };
  });
  return points.every((point) => Number.isFinite(point.at) && Number.isFinite(point.value)) ? { points, unit } : null;
}

/** A curve over height whose points are dragged; change(text, hurry) is told of each. */
export class RampEditor {
  element;
  #svg;
  #ends;
  #points = [];
  #unit;
  #low;
  #high;
  #change;

  constructor(control, change) {
    this.#change = change;
    this.#unit = ["%", "x"].includes(control.unit) ? control.unit : "";
    this.#low = control.low ?? 0;
    this.#high = control.high ?? 2;
    this.#svg = makeSvg("svg", { viewBox: `0 0 ${kWidth} ${kHeight}`, preserveAspectRatio: "none", role: "group", "aria-label": `${control.name} by height; double click adds a point, Delete takes it away` });
    this.#ends = make("div", { class: "ends" });
    this.element = make("div", { class: "ramp" }, this.#svg, this.#ends);
    this.#svg.addEventListener("dblclick", (event) => {
      const { at, value } = this.#place(event);
      this.#points.push({ at, value });
      this.#points.sort((a, b) => a.at - b.at);
      this.#tell(false);
      this.#draw();
    });
  }

  /** Shows a text; one that is not a ramp becomes a flat one of `value`. */
  show(text, value) {
    const ramp = rampOf(text);
    if (ramp) {
      this.#points = ramp.points;
      this.#unit = ramp.unit;
    } else {
      this.#points = [{ at: 0, value }, { at: 1, value }];
    }
    const most = Math.max(...this.#points.map((point) => point.value));
    if (most > this.#high) this.#high = most * 1.25;
    this.#draw();
  }

  #x(at) {
    return kEdge + at * (kWidth - 2 * kEdge);
  }

  #y(value) {
    return kHeight - kEdge - ((value - this.#low) / (this.#high - this.#low)) * (kHeight - 2 * kEdge);
  }

  #place(event) {
    const box = this.#svg.getBoundingClientRect();
    const x = ((event.clientX - box.left) / box.width) * kWidth, y = ((event.clientY - box.top) / box.height) * kHeight;
    const clamp = (number) => Math.min(1, Math.max(0, number));
    const share = clamp((kHeight - kEdge - y) / (kHeight - 2 * kEdge));
    return { at: Number(clamp((x - kEdge) / (kWidth - 2 * kEdge)).toFixed(2)), value: Number(short(this.#low + share * (this.#high - this.#low), 3)) };
  }

  #tell(hurry) {
    const text = this.#points.map(({ at, value }) => `${short(at, 3)}=${short(value, 4)}${this.#unit}`).join(",");
    this.#change(`height:${text}`, hurry);
  }

  #move(index, { at, value }) {
    const before = this.#points[index - 1]?.at ?? -0.01, after = this.#points[index + 1]?.at ?? 1.01;
    this.#points[index] = { at: Number(Math.min(after - 0.01, Math.max(before + 0.01, at)).toFixed(2)), value };
    this.#update();
  }

  #draw() {
    const circles = this.#points.map((_, index) => {
      const circle = makeSvg("circle", { r: 6, tabindex: 0, role: "slider" });
      follow(circle, {
        start: (event) => event.stopPropagation(),
        move: (event) => {
          this.#move(index, this.#place(event));
          this.#tell(true);
        },
        end: () => this.#tell(false),
      });
      circle.addEventListener("keydown", (event) => this.#key(event, index));
      circle.addEventListener("dblclick", (event) => event.stopPropagation());
      return circle;
    });
    this.#svg.replaceChildren(makeSvg("path"), ...circles);
    this.#ends.replaceChildren(make("span", {}, "lowest point"), make("span", {}, `${short(this.#low, 3)} to ${short(this.#high, 3)}${this.#unit}`), make("span", {}, "highest"));
    this.#update();
  }

  #update() {
    const [path, ...circles] = this.#svg.children;
    const places = this.#points.map(({ at, value }) => `${this.#x(at)} ${this.#y(value)}`);
    path.setAttribute("d", `M0 ${this.#y(this.#points[0].value)} L${places.join(" L")} L${kWidth} ${this.#y(this.#points.at(-1).value)}`);
    circles.forEach((circle, i) => {
      const { at, value } = this.#points[i];
      circle.setAttribute("cx", this.#x(at));
      circle.setAttribute("cy", this.#y(value));
      circle.setAttribute("aria-label", `Point at height ${at}`);
      circle.setAttribute("aria-valuetext", `${value}${this.#unit} at height ${at}`);
      circle.setAttribute("aria-valuenow", value);
    });
  }

  #key(event, index) {
    const step = (this.#high - this.#low) / 50, { at, value } = this.#points[index];
    const moved = { ArrowLeft: [at - 0.02, value], ArrowRight: [at + 0.02, value], ArrowUp: [at, Math.min(this.#high, value + step)], ArrowDown: [at, Math.max(this.#low, value - step)] }[event.key];
    if (moved) {
      this.#move(index, { at: Math.min(1, Math.max(0, moved[0])), value: Number(short(moved[1], 3)) });
      this.#tell(false);
    } else if (event.key === "Delete" && this.#points.length > 1) {
      this.#points.splice(index, 1);
      this.#tell(false);
      this.#draw();
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  }
}
