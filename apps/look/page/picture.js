import { byId, follow } from "./dom.js";

/** The canvas with the picture, the pinned one beside it, and the histogram. */
export class Picture extends EventTarget {
  #canvas = byId("picture");
  #divider = byId("divider");
  #now = null;
  #pinned = null;
  #share = 0.5;
  #order = 0;
  #drawn = 0;
  isSplit = false;
  /** What came with the picture that is shown. */
  message = null;

  constructor() {
    super();
    new ResizeObserver(() => this.draw()).observe(this.#canvas);
    follow(this.#divider, { start: () => true, move: (event) => this.#divide(event.clientX) });
    this.#divider.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      this.#share = Math.min(1, Math.max(0, this.#share + step));
      this.draw();
    });
  }

  /** Shows a picture once it is decoded, unless a newer one is by then, or isCurrent() says that it is stale. */
  async take(message, payload, isCurrent) {
    const order = ++this.#order;
    const bitmap = await createImageBitmap(new Blob([payload], { type: message.mime }));
    if (order < this.#drawn || !isCurrent()) {
      bitmap.close();
      return false;
    }
    this.#drawn = order;
    if (this.#now && this.#now !== this.#pinned) this.#now.close();
    this.#now = bitmap;
    this.message = message;
    this.draw();
    this.#count();
    this.dispatchEvent(new Event("shown"));
    return true;
  }

  pin() {
    if (!this.#now) return false;
    if (this.#pinned && this.#pinned !== this.#now) this.#pinned.close();
    this.#pinned = this.#now;
    return true;
  }

  /** Where the picture is, in CSS pixels of the canvas. */
  place() {
    const width = this.#canvas.clientWidth, height = this.#canvas.clientHeight;
    if (!this.#now) return { left: 0, top: 0, width, height };
    const scale = Math.min(width / this.#now.width, height / this.#now.height);
    const own = { width: this.#now.width * scale, height: this.#now.height * scale };
    return { left: (width - own.width) / 2, top: (height - own.height) / 2, ...own };
  }

  /** Share of the picture's width and height at a place of the window; null outside. */
  at(clientX, clientY) {
    const box = this.#canvas.getBoundingClientRect(), place = this.place();
    const x = (clientX - box.left - place.left) / place.width, y = (clientY - box.top - place.top) / place.height;
    return this.#now && x >= 0 && y >= 0 && x < 1 && y < 1 ? { x, y } : null;
  }

  draw() {
    const scale = window.devicePixelRatio || 1;
    const width = Math.round(this.#canvas.clientWidth * scale), height = Math.round(this.#canvas.clientHeight * scale);
    if (this.#canvas.width !== width || this.#canvas.height !== height) Object.assign(this.#canvas, { width, height });
    const context = this.#canvas.getContext("2d");
    context.imageSmoothingQuality = "high";
    context.clearRect(0, 0, width, height);
    const { left, top, width: w, height: h } = this.place();
    const isSplit = this.isSplit && this.#pinned;
    if (this.#now) context.drawImage(this.#now, left * scale, top * scale, w * scale, h * scale);
    if (isSplit) {
      context.save();
      context.beginPath();
      context.rect(left * scale, top * scale, w * scale * this.#share, h * scale);
      context.clip();
      // A pinned picture of another shape keeps its own.
      const fit = Math.min(w / this.#pinned.width, h / this.#pinned.height);
      const own = { w: this.#pinned.width * fit, h: this.#pinned.height * fit };
      context.fillStyle = getComputedStyle(document.body).backgroundColor;
      context.fillRect(left * scale, top * scale, w * scale, h * scale);
      context.drawImage(this.#pinned, (left + (w - own.w) / 2) * scale, (top + (h - own.h) / 2) * scale, own.w * scale, own.h * scale);
      context.restore();
    }
    this.#divider.hidden = !isSplit;
    Object.assign(this.#divider.style, { left: `${left + w * this.#share}px`, top: `${top}px`, height: `${h}px` });
    this.#divider.setAttribute("aria-valuenow", Math.round(this.#share * 100));
  }

  /** A small copy as a data address. */
  thumbnail(width) {
    if (!this.#now) return "";
    const canvas = document.createElement("canvas");
    canvas.width = width;
    canvas.height = Math.round((width * this.#now.height) / this.#now.width);
    canvas.getContext("2d").drawImage(this.#now, 0, 0, canvas.width, canvas.height);
    return canvas.toDataURL("image/jpeg", 0.8);
  }

  #divide(clientX) {
    const place = this.place(), box = this.#canvas.getBoundingClientRect();
    this.#share = Math.min(1, Math.max(0, (clientX - box.left - place.left) / place.width));
    this.draw();
  }

  #count() {
    const small = document.createElement("canvas");
    small.width = 160;
    small.height = Math.max(1, Math.round((160 * this.#now.height) / this.#now.width));
    const from = small.getContext("2d", { willReadFrequently: true });
    from.drawImage(this.#now, 0, 0, small.width, small.height);
    const pixels = from.getImageData(0, 0, small.width, small.height).data;
    const kBins = 64, bins = [0, 1, 2].map(() => new Float32Array(kBins));
    for (let i = 0; i < pixels.length; i += 4) for (let c = 0; c < 3; c++) bins[c][(pixels[i + c] * kBins) >> 8]++;
    const canvas = byId("histogram"), context = canvas.getContext("2d");
    const { width, height } = canvas;
    context.clearRect(0, 0, width, height);
    // The highest bins are often of an empty sky; the square root keeps the others seen.
    const most = Math.sqrt(Math.max(...bins.map((bin) => Math.max(...bin))));
    const isLight = getComputedStyle(document.documentElement).colorScheme === "light";
    context.globalCompositeOperation = isLight ? "multiply" : "screen";
    ["#e2564a", "#4fb45d", "#4c83e0"].forEach((color, c) => {
      context.beginPath();
      context.moveTo(0, height);
      bins[c].forEach((count, i) => context.lineTo((i / (kBins - 1)) * width, height - (Math.sqrt(count) / most) * (height - 6)));
      context.lineTo(width, height);
      context.fillStyle = color;
      context.globalAlpha = 0.75;
      context.fill();
    });
    context.globalAlpha = 1;
    context.globalCompositeOperation = "source-over";
  }
}
