import { byId } from "./dom.js";

const kKey = "nephele-theme";
const kNext = { system: "dark", dark: "light", light: "system" };

/** Dark, light, or as the system is; changed() is called after each change. */
export function startTheme(changed) {
  const light = matchMedia("(prefers-color-scheme: light)");
  const button = byId("theme");
  let chosen = localStorage.getItem(kKey) ?? "system";
  const apply = () => {
    document.documentElement.dataset.theme = chosen === "system" ? (light.matches ? "light" : "dark") : chosen;
    button.title = `Theme: ${chosen}`;
    button.setAttribute("aria-label", `Theme: ${chosen}`);
    changed();
  };
  button.addEventListener("click", () => {
    chosen = kNext[chosen] ?? "system";
    localStorage.setItem(kKey, chosen);
    apply();
  });
  light.addEventListener("change", apply);
  apply();
}
