import { byId, make } from "./dom.js";
import { kPage, post } from "./stream.js";

/** Writes a text to the clipboard, in browsers and places that have none of the new one, too. */
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const area = make("textarea", { ".value": text, style: "position:fixed;opacity:0" });
    (document.querySelector("dialog[open]") ?? document.body).append(area);
    area.select();
    const isDone = document.execCommand("copy");
    area.remove();
    return isDone;
  }
}

/** Hands a text to the browser as a file. */
function download(name, text) {
  const address = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
  const link = make("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

const kKinds = [
  { what: "exr", title: "EXR picture", file: "cloud.exr", second: "1280x720", label: "Size in pixels", action: "Render" },
  { what: "png", title: "PNG preview", file: "cloud.png", second: "1280x720", label: "Size in pixels", action: "Render" },
  { what: "vdb", title: "Volume", file: "cloud.vdb", action: "Write", needsCloud: true },
  { what: "turntable", title: "Turntable", file: "cloud.mp4", second: "1-48", label: "Frames", action: "Render" },
];
// Of views that are no volumes.
const kKindsOf = {
  pieces: [
    { what: "pieces", title: "Pieces", file: "pieces", action: "Write" },
    { what: "png", title: "PNG preview", file: "pieces.png", second: "1280x720", label: "Size in pixels", action: "Render" },
  ],
  transfer: [
    { what: "mesh", title: "Mesh", file: "object_uv.obj", action: "Write" },
    { what: "png", title: "PNG preview", file: "transfer.png", second: "1280x720", label: "Size in pixels", action: "Render" },
  ],
};
const kWords = { exr: "EXR picture", png: "PNG preview", vdb: "Volume", turntable: "Turntable", script: "Script", pieces: "Pieces", mesh: "Mesh" };

// What files and command lines show otherwise than the page.
const kOfTheCloud = "These make the cloud in its light, not this view of it.";
const kOfShapes = "These look from where View says, through a lens of their own, without the exposure.";
const kDifferences = { surface: kOfTheCloud, checker: kOfTheCloud, pieces: kOfShapes, transfer: kOfShapes };

/** The dialog for what comes out: command lines, recipes, and files that the program writes. */
export class Outputs {
  #settings;
  #body;
  #jobs = new Map();
  #lines = [];
  #hasCloud = false;
  // Those that are offered.
  #kinds = null;

  constructor(settings, body) {
    this.#settings = settings;
    this.#body = body;
    byId("open-out").addEventListener("click", () => this.#open());
    byId("out-copy").addEventListener("click", async () => this.#say((await copy(this.#lines.join("\n"))) ? "Copied." : "The browser does not allow it; select the text."));
    byId("out-link").addEventListener("click", async () => this.#say((await copy(location.href)) ? "The link opens this look while the program runs." : "The browser does not allow it."));
    byId("out-recipe").addEventListener("click", () => this.#recipe());
  }

  setInput({ has_cloud: hasCloud, input }) {
    byId("out-recipe").textContent = input.kind === "script" ? "Save the script" : "Save as recipe";
    this.#hasCloud = hasCloud;
    this.#kinds = null;
  }

  take({ id, what, state, fraction, stage, message }) {
    let job = this.#jobs.get(id);
    if (!job) {
      const stop = make("button", { type: "button" }, "Stop");
      stop.addEventListener("click", () => post("stop", { id }).catch(() => {}));
      job = { bar: make("progress", { max: 1 }), stop, text: make("p"), element: null };
      job.element = make("div", { class: "job", "data-job": id }, make("span", {}, kWords[what] ?? what), job.bar, stop, job.text);
      this.#jobs.set(id, job);
      byId("jobs").prepend(job.element);
    }
    job.element.dataset.state = state;
    job.bar.value = state === "done" ? 1 : (fraction ?? 0);
    job.bar.setAttribute("aria-label", `${kWords[what] ?? what}: ${state}`);
    job.stop.hidden = state !== "running";
    const words = { running: "", done: "Done. ", failed: "Failed. ", stopped: "Stopped. " }[state] ?? "";
    job.text.textContent = words + (message || stage || "");
    job.text.classList.toggle("error", state === "failed");
  }

  #say(text) {
    byId("out-said").textContent = text;
  }

  async #open() {
    this.#say("");
    byId("out-error").textContent = "";
    byId("out").showModal();
    try {
      const { settings, size, show } = this.#body();
      this.#offer(kKindsOf[show.what] ?? kKinds);
      this.#say(kDifferences[show.what] ?? "");
      // The same frame as the one that is seen.
      for (const input of document.querySelectorAll("#jobs-new [data-size]")) input.value = size[0] > 640 ? size.join("x") : `1280x${2 * Math.round((640 * size[1]) / size[0])}`;
      this.#lines = (await post("command", { settings, size, show })).lines;
      byId("out-lines").textContent = this.#lines.join("\n");
    } catch (error) {
      byId("out-lines").textContent = error.message;
    }
  }

  #offer(kinds) {
    if (kinds === this.#kinds) return;
    this.#kinds = kinds;
    byId("jobs-new").replaceChildren(...kinds.filter((kind) => this.#hasCloud || !kind.needsCloud).map((kind) => this.#new(kind)));
  }

  async #recipe() {
    try {
      const { name, text } = await post("recipe", { settings: this.#settings.copy(), show: this.#body().show });
      download(name, text);
      this.#say(`${name} is saved by the browser.`);
    } catch (error) {
      byId("out-error").textContent = error.message;
    }
  }

  #new(kind) {
    const file = make("input", { value: kind.file, "aria-label": `${kind.title}: file`, autocomplete: "off", spellcheck: "false" });
    const second = kind.second ? make("input", { value: kind.second, "aria-label": `${kind.title}: ${kind.label}`, title: kind.label, autocomplete: "off", "data-size": kind.what !== "turntable" }) : make("span");
    const start = make("button", { type: "button", "data-job-of": kind.what }, kind.action);
    start.addEventListener("click", async () => {
      byId("out-error").textContent = "";
      const { settings, size, show } = this.#body();
      const typed = /^\s*(\d+)\s*[x×]\s*(\d+)\s*$/.exec(second.value ?? "");
      if ("size" in second.dataset && !typed) {
        byId("out-error").textContent = `${kind.title}: got '${second.value}' as the size, allowed: WIDTHxHEIGHT`;
        return;
      }
      const body = { page: kPage, what: kind.what, file: file.value.trim(), settings, show, size: typed ? [Number(typed[1]), Number(typed[2])] : size };
      if (kind.what === "turntable") body.frames = second.value.trim();
      try {
        await post("job", body);
      } catch (error) {
        byId("out-error").textContent = error.message;
      }
    });
    return make("div", { class: "new" }, make("span", {}, kind.title), file, second, start);
  }
}
