import { byId, short } from "./dom.js";

const add = (a, b) => a.map((x, i) => x + b[i]);
const minus = (a, b) => a.map((x, i) => x - b[i]);
const times = (a, s) => a.map((x) => x * s);
const length = (a) => Math.hypot(...a);
const unit = (a) => times(a, 1 / (length(a) || 1));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

const kRadians = Math.PI / 180;
const kPole = 89 * kRadians;
// A wheel has no end of its own.
const kWheelEnd = 220;

/** Azimuth from +z towards +x and elevation, in degrees, of a direction. */
export function anglesOf([x, y, z]) {
  const flat = Math.hypot(x, z);
  return [flat > 1e-9 ? Math.atan2(x, z) / kRadians : 0, Math.atan2(y, flat) / kRadians];
}

/** Moves the camera by mouse, touch and keys, and writes it into the settings of `render`. */
export class Camera {
  #canvas = byId("picture");
  #settings;
  #picture;
  #commit;
  #pointers = new Map();
  #own = null;
  #wheelTimer = 0;
  #isMoved = false;

  constructor(settings, picture, commit) {
    this.#settings = settings;
    this.#picture = picture;
    this.#commit = commit;
    const canvas = this.#canvas;
    canvas.addEventListener("pointerdown", (event) => this.#down(event));
    canvas.addEventListener("pointermove", (event) => this.#moved(event));
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => this.#up(event));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    canvas.addEventListener("keydown", (event) => this.#key(event));
    for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => this.view(button.dataset.view));
    byId("frame").addEventListener("click", () => this.frame());
  }

  get isDragging() {
    return this.#pointers.size > 0;
  }

  /** Stands in a direction, at the distance that frames all. */
  view(angles) {
    this.#own = null;
    this.#settings.set("render", { "camera-position": undefined, "look-at": undefined, up: undefined, "orthographic-width": undefined, view: angles });
    this.#commit();
  }

  /** All in the picture, from where the camera is. */
  frame() {
    const camera = this.#start();
    if (!camera) return;
    const [azimuth, elevation] = anglesOf(minus(camera.position, camera.look_at));
    this.view(`${short(azimuth, 4)},${short(elevation, 4)}`);
  }

  /** Where the camera is: as set, or as the last picture was made. */
  #start() {
    const message = this.#picture.message;
    if (!message) return null;
    const { position, look_at: target, fov, orthographic_width: wide } = message.camera;
    const numbers = (name) => this.#settings.get("render", name)?.split(",").map(Number);
    return {
      position: numbers("camera-position") ?? position,
      look_at: (numbers("camera-position") && numbers("look-at")) ?? target,
      up: numbers("up") ?? [0, 1, 0],
      fov,
      // Shapes in a row, which stands across the view from wherever the camera is.
      turns: message.turns,
      wide: wide > 0 ? Number(this.#settings.get("render", "orthographic-width") ?? wide) : 0,
    };
  }

  #write(hurry) {
    const { position, look_at: target, wide } = this.#own;
    const text = (vector) => {
      const digits = Math.max(0, 4 - Math.floor(Math.log10(this.#extent())));
      return vector.map((x) => String(Number(x.toFixed(Math.min(digits, 12))))).join(",");
    };
    const values = { "camera-position": text(position), "look-at": text(target) };
    if (wide) values["orthographic-width"] = short(wide, 5);
    this.#settings.set("render", values, hurry);
  }

  #extent() {
    const [low, high] = this.#picture.message.bounds;
    return Math.max(length(minus(high, low)), 1e-6);
  }

  #orbit(right, down) {
    const { position, look_at, turns } = this.#own;
    const away = minus(position, look_at), distance = length(away);
    let [azimuth, elevation] = anglesOf(away).map((degrees) => degrees * kRadians);
    azimuth -= right;
    const target = turns ? this.#turned(look_at, -right) : look_at;
    this.#own.look_at = target;
    elevation = Math.min(kPole, Math.max(-kPole, elevation + down));
    const flat = Math.cos(elevation);
    this.#own.position = add(target, times([Math.sin(azimuth) * flat, Math.sin(elevation), Math.cos(azimuth) * flat], distance));
  }

  /** Round the vertical axis through the origin, by an angle from +z towards +x. */
  #turned([x, y, z], angle) {
    const c = Math.cos(angle), s = Math.sin(angle);
    return [x * c + z * s, y, z * c - x * s];
  }

  /** By shares of the picture's width. */
  #pan(right, down) {
    const { position, look_at: target, up, fov, wide } = this.#own;
    const ahead = minus(target, position), side = unit(cross(ahead, up)), over = unit(cross(side, ahead));
    const across = wide || 2 * length(ahead) * Math.tan((fov * kRadians) / 2);
    const way = add(times(side, -right * across), times(over, down * across));
    this.#own.position = add(position, way);
    this.#own.look_at = add(target, way);
  }

  #dolly(factor) {
    const { position, look_at: target } = this.#own;
    const away = minus(position, target), distance = length(away);
    const allowed = Math.min(Math.max(distance * factor, 1e-3 * this.#extent()), 100 * this.#extent());
    if (this.#own.wide) this.#own.wide *= factor;
    this.#own.position = add(target, times(away, allowed / distance));
  }

  #down(event) {
    if (event.pointerType === "mouse" && event.button > 2) return;
    event.preventDefault();
    this.#canvas.focus({ preventScroll: true });
    this.#canvas.setPointerCapture(event.pointerId);
    if (this.#pointers.size === 0) {
      this.#own = this.#start();
      this.#isMoved = false;
    }
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, isPan: event.shiftKey || event.button > 0 });
  }

  #moved(event) {
    const last = this.#pointers.get(event.pointerId);
    if (!last || !this.#own) return;
    const right = event.clientX - last.x, down = event.clientY - last.y;
    if (!this.#isMoved && Math.hypot(right, down) < 3) return;
    this.#isMoved = true;
    const width = this.#picture.place().width || 1;
    if (this.#pointers.size === 2) {
      const [other] = [...this.#pointers].filter(([id]) => id !== event.pointerId).map(([, place]) => place);
      const before = Math.hypot(last.x - other.x, last.y - other.y), now = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      if (before > 1 && now > 1) this.#dolly(before / now);
      this.#pan(right / 2 / width, down / 2 / width);
    } else if (this.#pointers.size === 1) {
      if (last.isPan) this.#pan(right / width, down / width);
      else this.#orbit((right / width) * Math.PI, (down / width) * Math.PI);
    }
    last.x = event.clientX;
    last.y = event.clientY;
    this.#write(true);
  }

  #up(event) {
    if (!this.#pointers.delete(event.pointerId) || this.#pointers.size > 0) return;
    if (this.#isMoved) this.#finish();
  }

  #finish() {
    if (!this.#own) return;
    this.#write(false);
    this.#own = null;
    this.#commit();
  }

  #wheel(event) {
    event.preventDefault();
    if (this.#pointers.size > 0) return;
    this.#own ??= this.#start();
    if (!this.#own) return;
    const lines = event.deltaMode === 1 ? 33 : event.deltaMode === 2 ? 400 : 1;
    this.#dolly(Math.exp(Math.min(Math.max(event.deltaY * lines, -240), 240) * (event.ctrlKey ? 0.006 : 0.0012)));
    this.#write(true);
    clearTimeout(this.#wheelTimer);
    this.#wheelTimer = setTimeout(() => this.#pointers.size === 0 && this.#finish(), kWheelEnd);
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const factor = { "+": 0.9, "=": 0.9, "-": 1 / 0.9, _: 1 / 0.9 }[event.key];
    if (!arrows && !factor) return;
    event.preventDefault();
    this.#own ??= this.#start();
    if (!this.#own) return;
    if (factor) this.#dolly(factor);
    else if (event.shiftKey) this.#pan(-arrows[0] * 0.04, -arrows[1] * 0.04);
    else this.#orbit(-arrows[0] * 5 * kRadians, -arrows[1] * 5 * kRadians);
    this.#write(true);
    clearTimeout(this.#wheelTimer);
    this.#wheelTimer = setTimeout(() => this.#pointers.size === 0 && this.#finish(), kWheelEnd);
  }
}
