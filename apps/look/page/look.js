import { Camera } from "./camera.js";
import { Controls, isLit } from "./controls.js";
import { byId, labelOf, make } from "./dom.js";
import { History } from "./history.js";
import { Looks } from "./looks.js";
import { Outputs } from "./outputs.js";
import { Picture } from "./picture.js";
import { fromFragment, Settings, toFragment } from "./settings.js";
import { get, kPage, Sender, Stream } from "./stream.js";
import { SunDome } from "./sun.js";
import { startTheme } from "./theme.js";
import { Wedge } from "./wedge.js";

// More pixels than this are for the export.
const kMostPixels = 1 << 20;

const settings = new Settings();
const history_ = new History();
const picture = new Picture();
const stream = new Stream();
const state = () => ({ settings: settings.copy(), what: settings.show.what });
const commit = () => history_.add(state());
const body = () => ({ settings: settings.copy(), size: sizeOfPicture(), show: { ...settings.show } });
const sender = new Sender(body);
const controls = new Controls(settings, commit);
const dome = new SunDome(settings, commit);
const camera = new Camera(settings, picture, commit);
const wedge = new Wedge(settings, commit, body);
const outputs = new Outputs(settings, body);
new Looks(settings, commit, picture);
startTheme(() => picture.draw());

let isLoaded = false;
let fragment = "";
let settled = 0;
// The last of which something is wrong.
let failed = -1;
// Ends once the picture that came last is on the canvas, or was overtaken.
let shown = Promise.resolve();

function sizeOfPicture() {
  const chosen = /^(\d+)x(\d+)$/.exec(byId("size").value);
  if (chosen) return [Number(chosen[1]), Number(chosen[2])];
  const { clientWidth: width, clientHeight: height } = byId("stage");
  const scale = Math.min(1, Math.sqrt(kMostPixels / Math.max(1, width * height)));
  const even = (x) => Math.min(4096, Math.max(16, 2 * Math.round((x * scale) / 2)));
  return [even(width), even(height)];
}

// What is said over the picture.

function say(text, { isCalm = false, more = "", key = "" } = {}) {
  const banner = byId("banner");
  banner.hidden = !text;
  banner.dataset.key = key;
  banner.classList.toggle("calm", isCalm);
  if (!text) return banner.replaceChildren();
  const close = make("button", { "aria-label": "Close", onclick: () => say("") }, "✕");
  banner.replaceChildren(make("div", {}, text, more ? make("pre", {}, more) : null), close);
}

function unsay(key) {
  if (byId("banner").dataset.key === key) say("");
}

function announce(text) {
  byId("said").textContent = text;
}

function ask(hurry) {
  byId("stage").setAttribute("aria-busy", "true");
  sender.ask(hurry);
}

/** Nothing more comes for the settings of the last request; its own answer may come later. */
function settle() {
  progress(null);
  settled = sender.revision;
  if (!sender.isBehind) byId("stage").setAttribute("aria-busy", "false");
}

function progress(fraction) {
  byId("progress").hidden = fraction === null;
  byId("progress").firstElementChild.style.width = `${Math.round((fraction ?? 0) * 100)}%`;
}

const seconds = (value) => (value < 1 ? `${Math.round(value * 1000)} ms` : `${value.toFixed(1)} s`);

function facts(message) {
  const parts = [`${message.width} × ${message.height}`];
  if (message.rays_per_pixel) {
    const rays = Number(message.rays_per_pixel.toPrecision(3));
    parts.push(`${rays} ${rays === 1 ? "ray" : "rays"} per pixel`);
  }
  if (message.voxels) parts.push(`${Math.round(message.voxels)} voxels`);
  parts.push(seconds(message.milliseconds / 1000));
  byId("facts").textContent = parts.join("   ·   ");
}

// From the program.

function take({ message, payload }) {
  const isCurrent = () => sender.isCurrent(message.revision, () => take({ message, payload }));
  switch (message.type) {
    case "picture":
      if (isCurrent()) shown = takePicture(message, payload);
      break;
    case "progress":
      if (!isCurrent()) break;
      byId("stage-text").textContent = labelOf(message.stage);
      progress(message.fraction);
      break;
    case "idle":
      if (isCurrent()) shown.finally(() => isCurrent() && finish(message));
      break;
    case "error":
      if (!isCurrent()) break;
      sender.seen(message.revision);
      settle();
      byId("stage-text").textContent = "Not made";
      failed = message.revision;
      showErrors([{ verb: message.verb, option: message.option, message: message.message, text: message.text }]);
      break;
    case "file":
      takeFile(message);
      break;
    case "wedge":
      wedge.take(message, payload);
      break;
    case "job":
      outputs.take(message);
      if (message.state !== "running") announce(`${message.what}: ${message.state}. ${message.message ?? ""}`);
      break;
    case "bye":
      say("The program has ended. Start nephele look again, and open its new address; the settings stay in this one.", { key: "connection" });
      break;
  }
}

async function takePicture(message, payload) {
  const isDragged = sender.isHurried;
  // The next one is made while this one is decoded.
  if (isDragged) sender.seen(message.revision);
  const isShown = await picture.take(message, payload, () => sender.isCurrent(message.revision) || (isDragged && sender.isHurried));
  sender.seen(message.revision);
  if (!isShown) return;
  byId("picture").dataset.revision = message.revision;
  facts(message);
  if (settled !== message.revision) byId("stage-text").textContent = message.final ? "Final" : labelOf(message.stage);
  dome.update(message);
  listLayers(message.layers);
}

function finish(message) {
  sender.seen(message.revision);
  settle();
  byId("stage-text").textContent = `Finished in ${seconds(message.seconds)}`;
  if (!camera.isDragging) announce(`Picture finished in ${seconds(message.seconds)}.`);
}

function takeFile({ path, state, message }) {
  if (state === "changed") {
    unsay("file");
    announce(`${path} has changed.`);
    load(true);
  } else {
    const [first, ...rest] = (message || `${path}: ${state}`).split("\n");
    say(first, { more: rest.join("\n"), key: "file" });
  }
}

function listLayers(layers) {
  const select = byId("layer");
  const names = [...new Set([...layers, settings.show.layer])];
  if (names.join() === [...select.options].map((option) => option.value).join()) return;
  select.replaceChildren(...names.map((name) => make("option", { value: name }, labelOf(name))));
  select.value = settings.show.layer;
}

function showErrors(errors) {
  const left = controls.showErrors(errors);
  const [first, ...rest] = left.map((error) => error.message).join("\n").split("\n");
  if (left.length) say(first, { more: rest.join("\n") || (errors[0].text ?? ""), key: "error" });
  else if (errors[0]?.text) say(errors[0].message, { more: errors[0].text, key: "error" });
  else unsay("error");
}

// From the settings.

function update() {
  controls.update();
  dome.update(picture.message);
  byId("what").value = settings.show.what;
  byId("layer").value = settings.show.layer;
  byId("layer").disabled = !isLit(settings.show.what);
  byId("false-color").setAttribute("aria-pressed", String(settings.show.false_color));
}

let fragmentTimer = 0;
function keepInAddress() {
  clearTimeout(fragmentTimer);
  fragmentTimer = setTimeout(() => {
    const size = byId("size").value;
    fragment = `#${toFragment({ settings: settings.copy(), show: settings.show, ...(size ? { size } : {}) })}`;
    history.replaceState(null, "", fragment);
  }, 250);
}

settings.addEventListener("change", ({ detail }) => {
  update();
  if (!isLoaded) return;
  ask(detail.hurry);
  keepInAddress();
});

sender.addEventListener("taken", () => {
  // What is wrong with it may be known before its answer has come.
  if (failed !== sender.revision) showErrors([]);
  if (settled === sender.revision) settle();
});
sender.addEventListener("refused", ({ detail }) => {
  settle();
  showErrors(detail.errors.length ? detail.errors : [{ message: detail.message }]);
});

history_.addEventListener("change", () => {
  byId("undo").disabled = !history_.canUndo;
  byId("redo").disabled = !history_.canRedo;
});

function step(to) {
  if (to) settings.replace(to.settings, { what: to.what });
}

// Pixel values.

let pixelTimer = 0;
function askPixel(event) {
  clearTimeout(pixelTimer);
  const place = picture.at(event.clientX, event.clientY);
  if (!place || camera.isDragging) {
    if (!place) byId("pixel").textContent = "";
    return;
  }
  pixelTimer = setTimeout(async () => {
    try {
      const { rgb, alpha, depth } = await get(`pixel?page=${kPage}&x=${place.x.toFixed(5)}&y=${place.y.toFixed(5)}`);
      const number = (x) => (Math.abs(x) < 1000 ? x.toFixed(3) : x.toPrecision(4));
      byId("pixel").textContent = rgb
        ? `R ${number(rgb[0])}  G ${number(rgb[1])}  B ${number(rgb[2])}   α ${number(alpha)}${depth === null || depth === undefined ? "" : `   depth ${number(depth)}`}`
        : "";
    } catch {
      byId("pixel").textContent = "";
    }
  }, 90);
}
byId("picture").addEventListener("pointermove", (event) => event.buttons === 0 && askPixel(event));
byId("picture").addEventListener("pointerup", (event) => setTimeout(() => askPixel(event)));
byId("picture").addEventListener("pointerleave", () => {
  clearTimeout(pixelTimer);
  byId("pixel").textContent = "";
});

// The bar.

byId("undo").addEventListener("click", () => step(history_.undo()));
byId("redo").addEventListener("click", () => step(history_.redo()));
byId("what").addEventListener("change", (event) => {
  settings.setShow({ what: event.target.value });
  commit();
});
byId("layer").addEventListener("change", (event) => settings.setShow({ layer: event.target.value }));
byId("size").addEventListener("change", () => settings.setShow({}));
byId("false-color").addEventListener("click", () => settings.setShow({ false_color: !settings.show.false_color }));
byId("pin").addEventListener("click", pin);
byId("split").addEventListener("click", () => split(!picture.isSplit));

function pin() {
  if (!picture.pin()) return;
  byId("split").disabled = false;
  split(true);
}

function split(isOn) {
  if (byId("split").disabled) return;
  picture.isSplit = isOn;
  byId("split").setAttribute("aria-pressed", String(isOn));
  picture.draw();
}

function exposure(stops) {
  const now = Number(settings.get("render", "exposure") ?? 0) + stops;
  settings.set("render", { exposure: Math.abs(now) < 1e-6 ? undefined : String(Number(now.toFixed(3))) });
  commit();
}

document.addEventListener("keydown", (event) => {
  const isTyping = event.target.matches("input:not([type=range]):not([type=checkbox]), textarea, select");
  const isCommand = event.ctrlKey || event.metaKey;
  if (isCommand && !event.altKey && event.key.toLowerCase() === "z" && !(isTyping && event.target.type !== "color")) {
    event.preventDefault();
    step(event.shiftKey ? history_.redo() : history_.undo());
    return;
  }
  if (isCommand && event.key.toLowerCase() === "y" && !isTyping) {
    event.preventDefault();
    step(history_.redo());
    return;
  }
  if (isTyping || isCommand || event.altKey || document.querySelector("dialog[open]")) return;
  const act = { f: () => camera.frame(), p: pin, b: () => split(!picture.isSplit), x: () => byId("false-color").click(), "/": () => controls.focusSearch(), "[": () => exposure(-0.25), "]": () => exposure(0.25) }[event.key.toLowerCase()];
  if (!act) return;
  event.preventDefault();
  act();
});

for (const dialog of document.querySelectorAll("dialog"))
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
byId("skip").addEventListener("click", (event) => {
  event.preventDefault();
  controls.focusSearch();
});

// A window of another size is another picture.
let sizeTimer = 0;
let lastSize = "";
new ResizeObserver(() => {
  clearTimeout(sizeTimer);
  sizeTimer = setTimeout(() => {
    const size = sizeOfPicture().join("x");
    if (isLoaded && size !== lastSize) ask(false);
    lastSize = size;
  }, 200);
}).observe(byId("stage"));

window.addEventListener("hashchange", () => {
  if (location.hash === fragment) return;
  const state = fromFragment(location.hash);
  if (!state) return;
  adopt(state);
  commit();
});

function adopt(state) {
  Object.assign(settings.show, state.show ?? {});
  byId("size").value = state.size ?? "";
  settings.replace(state.settings);
}

async function load(isAgain = false) {
  let given;
  try {
    given = await get("controls");
  } catch (error) {
    if (isLoaded || error.status) say(error.message, { key: "file" });
    return;
  }
  byId("input").textContent = given.input.name.split("/").pop();
  document.title = `${given.input.name.split("/").pop()} · Nephele`;
  byId("input").title = `${given.input.name} (${given.input.kind}), version ${given.version}`;
  controls.build(given);
  wedge.reset();
  outputs.setInput(given);
  dome.setDefault(settings.table.render.sun?.default ?? "");
  for (const option of byId("what").options) option.hidden = option.disabled = !given.views.includes(option.value);
  if (isLoaded) {
    if (isAgain) dropGoneParameters(given.parameters);
    ask(false);
    return;
  }
  adopt(fromFragment(location.hash) ?? { settings: given.settings, show: { what: given.show } });
  history_.begin(state());
  isLoaded = true;
  lastSize = sizeOfPicture().join("x");
  ask(false);
}

/** A script that was saved without them would refuse them. */
function dropGoneParameters(parameters) {
  const names = new Set(parameters.map((parameter) => parameter.name));
  const next = settings.copy();
  const gone = Object.keys(next.parameters).filter((name) => !names.has(name));
  for (const name of gone) delete next.parameters[name];
  if (gone.length) settings.replace(next);
}

stream.addEventListener("message", ({ detail }) => take(detail));
stream.addEventListener("connection", ({ detail }) => {
  document.body.dataset.connection = detail;
  if (detail === "open") {
    if (!byId("banner").hidden && byId("banner").dataset.key === "connection") {
      say("");
      announce("Connected again.");
    }
    load();
  } else {
    progress(null);
    byId("stage-text").textContent = "Not connected";
    say(
      detail === "gone"
        ? "Another program answers at this address now. Start nephele look again, and open its new address; the settings stay in this one."
        : "The connection to the program is lost. Trying again each second…",
      { key: "connection" },
    );
  }
});
stream.run();
