import { byId, make } from "./dom.js";
import { clone } from "./settings.js";
import { get, post } from "./stream.js";

const kKept = "nephele-look-";
// They say how finely something is made, not how it looks.
const kKeptByUser = [["cloud", "resolution"], ["cloud", "voxel-size"], ["wisps", "resolution"], ["wisps", "voxel-size"], ["render", "quality"], ["render", "samples"]];

/** The dialog of looks: those that ship and those that the user saved. */
export class Looks {
  #settings;
  #commit;
  #picture;

  constructor(settings, commit, picture) {
    this.#settings = settings;
    this.#commit = commit;
    this.#picture = picture;
    byId("open-looks").addEventListener("click", () => this.#open());
    byId("look-save").addEventListener("click", () => this.#save());
    byId("look-name").addEventListener("keydown", (event) => event.key === "Enter" && this.#save());
  }

  async #open() {
    byId("look-error").textContent = "";
    byId("looks").showModal();
    try {
      this.#list(await get("controls"));
    } catch (error) {
      byId("look-error").textContent = error.message;
    }
  }

  #list({ looks, saved }) {
    const tile = (look, source, kind) => {
      const blank = () => make("div", { class: "blank" });
      const image = source ? make("img", { src: source, alt: "", loading: "lazy" }) : blank();
      image.addEventListener("error", () => image.replaceWith(blank()));
      const button = make("button", { type: "button", class: `tile ${kind}`, "data-look": look.name }, image, make("span", {}, kind === "own" ? look.name : look.name.replaceAll("-", " ")));
      button.addEventListener("click", () => this.#take(look));
      return button;
    };
    byId("looks-list").replaceChildren(
      ...saved.map((look) => tile(look, localStorage.getItem(kKept + look.name), "own")),
      ...looks.map((look) => tile(look, `look/${encodeURIComponent(look.name)}.jpg`, "shipped")),
    );
  }

  #take({ settings, show }) {
    const now = this.#settings.copy();
    // One that was saved has all parts and keeps to what is seen; one that ships is of a cloud or of wisps.
    const parts = show ? [show, "render"] : Object.keys(settings);
    const next = { ...now, ...Object.fromEntries(parts.map((part) => [part, clone(settings[part])])), parameters: now.parameters };
    for (const [verb, name] of kKeptByUser) {
      const own = this.#settings.get(verb, name);
      if (own === undefined) delete next[verb][name];
      else next[verb][name] = own;
    }
    this.#settings.replace(next, show ? { what: show } : {});
    this.#commit();
    byId("looks").close();
  }

  async #save() {
    const name = byId("look-name").value.trim();
    byId("look-error").textContent = "";
    if (!name) {
      byId("look-error").textContent = "Give the look a name first.";
      return;
    }
    try {
      await post("save-look", { name, settings: this.#settings.copy(), show: this.#settings.show });
      try {
        localStorage.setItem(kKept + name, this.#picture.thumbnail(240));
      } catch {
        // Without room for a thumbnail the look has none.
      }
      byId("look-name").value = "";
      this.#list(await get("controls"));
    } catch (error) {
      byId("look-error").textContent = error.message;
    }
  }
}
