import { anglesOf } from "./camera.js";
import { byId, follow, makeSvg, short } from "./dom.js";

const kRadians = Math.PI / 180;
const kRim = 54;

/** The dome of the sky from above, as the camera stands: what is below is behind the camera. The first sun is dragged on it. */
export class SunDome {
  #dome = byId("dome");
  #fields = [byId("sun-azimuth"), byId("sun-elevation")];
  #settings;
  #commit;
  #default = "90,38";
  #turn = 0;
  // The angles of the last picture; undefined before there is one.
  #shown;
  #isDragging = false;
  #sun = makeSvg("g");
  #timer = 0;

  constructor(settings, commit) {
    this.#settings = settings;
    this.#commit = commit;
    const rings = [30, 60].map((elevation) => makeSvg("circle", { r: kRim * (1 - elevation / 90), fill: "none", stroke: "currentColor", "stroke-opacity": 0.18 }));
    this.#sun.append(
      makeSvg("line", { x1: 0, y1: 0, stroke: "var(--sun)", "stroke-opacity": 0.55, "stroke-dasharray": "2 3" }),
      makeSvg("circle", { r: 13, fill: "var(--sun)", "fill-opacity": 0.22 }),
      makeSvg("circle", { r: 6.5, fill: "var(--sun)" }),
    );
    this.#dome.append(
      makeSvg(
        "svg",
        { viewBox: "-62 -62 124 124", "aria-hidden": "true" },
        makeSvg("defs", {}, makeSvg("radialGradient", { id: "sky" }, makeSvg("stop", { offset: 0, "stop-color": "var(--sky-1)" }), makeSvg("stop", { offset: 1, "stop-color": "var(--sky-2)" }))),
        makeSvg("circle", { r: kRim, fill: "url(#sky)", stroke: "var(--line)" }),
        ...rings,
        makeSvg("path", { d: "M-5 61 0 55.5 5 61z", fill: "var(--muted)" }),
        this.#sun,
      ),
    );
    follow(this.#dome, {
      start: (event) => {
        this.#isDragging = true;
        this.#drag(event);
      },
      move: (event) => this.#drag(event),
      end: (event) => {
        this.#drag(event, false);
        this.#isDragging = false;
        this.#commit();
      },
    });
    this.#dome.addEventListener("keydown", (event) => this.#key(event));
    this.#dome.addEventListener("dblclick", () => this.#put(undefined));
    this.#fields.forEach((field, i) =>
      field.addEventListener("change", () => {
        const angles = this.#angles() ?? [90, 38];
        const typed = Number(field.value);
        if (field.value.trim() !== "" && Number.isFinite(typed)) angles[i] = typed;
        this.#write(angles, false);
        this.#commit();
      }),
    );
  }

  setDefault(text) {
    if (/^-?[\d.]+,-?[\d.]+/.test(text)) this.#default = text;
  }

  /** Draws the sun as the settings have it, or else the last picture, seen by its camera. */
  update(message) {
    const camera = message?.camera;
    if (message) this.#shown = message.sun ?? null;
    if (camera && !this.#isDragging) this.#turn = anglesOf(camera.position.map((x, i) => x - camera.look_at[i]))[0];
    const angles = this.#angles();
    this.#sun.style.display = angles ? "" : "none";
    this.#fields.forEach((field, i) => {
      if (document.activeElement !== field) field.value = angles ? short(angles[i], 4) : "";
    });
    this.#dome.setAttribute("aria-valuetext", angles ? `azimuth ${short(angles[0], 4)} degrees, elevation ${short(angles[1], 4)} degrees` : "none");
    if (!angles) return;
    this.#dome.setAttribute("aria-valuenow", Math.round(angles[0]));
    const from = (angles[0] - this.#turn) * kRadians, far = kRim * Math.min(1, Math.max(0, 1 - angles[1] / 90));
    const x = Math.sin(from) * far, y = Math.cos(from) * far;
    const [line, ...circles] = this.#sun.children;
    line.setAttribute("x2", x);
    line.setAttribute("y2", y);
    for (const circle of circles) {
      circle.setAttribute("cx", x);
      circle.setAttribute("cy", y);
    }
  }

  #suns() {
    const suns = this.#settings.get("render", "sun");
    if (suns && suns.length) return Array.isArray(suns) ? suns : [suns];
    if (this.#shown === undefined) return [this.#default];
    return [this.#shown ? this.#shown.map((angle, i) => short(i ? angle : (angle + 360) % 360, 4)).join(",") : "none"];
  }

  #angles() {
    const parts = this.#suns()[0].replace(/^[^=,]*=/, "").split(",").map(Number);
    return parts.length >= 2 && Number.isFinite(parts[0]) && Number.isFinite(parts[1]) ? parts.slice(0, 2) : null;
  }

  #write([azimuth, elevation], hurry) {
    const suns = this.#suns();
    const name = /^[^=,]*=/.exec(suns[0])?.[0] ?? "";
    const rest = this.#angles() ? suns[0].slice(name.length).split(",").slice(2) : [];
    const first = name + [short(azimuth, 4), short(elevation, 4), ...rest].join(",");
    this.#settings.set("render", { sun: [first, ...suns.slice(1)] }, hurry);
  }

  #put(value) {
    this.#settings.set("render", { sun: value });
    this.#commit();
  }

  #drag(event, hurry = true) {
    const box = this.#dome.getBoundingClientRect();
    const x = event.clientX - box.left - box.width / 2, y = event.clientY - box.top - box.height / 2;
    const far = Math.min(1, Math.hypot(x, y) / ((box.width * kRim) / 124));
    const azimuth = (Math.round(Math.atan2(x, y) / kRadians + this.#turn) + 720) % 360;
    this.#write([azimuth, Math.round(90 * (1 - far) * 2) / 2], hurry);
  }

  #key(event) {
    const step = event.shiftKey ? 10 : 2;
    const way = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] }[event.key];
    if (!way || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    const angles = this.#angles() ?? [90, 38];
    this.#write([(angles[0] + way[0] + 360) % 360, Math.min(90, Math.max(-10, angles[1] + way[1]))], true);
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      this.#write(this.#angles(), false);
      this.#commit();
    }, 220);
  }
}
