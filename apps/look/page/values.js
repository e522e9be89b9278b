import { short } from "./dom.js";

/** Number and unit of a text; null where it is not one number. */
export function numberOf(text) {
  const found = /^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-z%°]*)\s*$/.exec(String(text ?? ""));
  return found ? { number: Number(found[1]), unit: found[2] } : null;
}

/** Units that belong to the text of a value; others only explain. */
export const isTyped = (unit) => unit === "%" || unit === "x";

/** A number as the text of a control. */
export const textOf = (number, control) => short(number, 4) + (isTyped(control.unit) ? control.unit : "");

const kSteps = 1000;

/** Where a slider of 0 to 1000 stands for a number, and back. */
export function toSlider(number, { low, high, logarithmic }) {
  const share = logarithmic ? Math.log(Math.max(number, low) / low) / Math.log(high / low) : (number - low) / (high - low);
  return Math.round(Math.min(1, Math.max(0, share)) * kSteps);
}

export function fromSlider(place, { low, high, step, logarithmic }) {
  const share = place / kSteps;
  if (!logarithmic) {
    const number = low + share * (high - low);
    return step ? Number((Math.round(number / step) * step).toFixed(6)) : number;
  }
  const number = low * (high / low) ** share;
  if (step >= 1) return Math.round(number);
  return Number(number.toPrecision(3));
}

const encode = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const decode = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

/** Linear "R,G,B" as #rrggbb, brighter than 1 as 1; back at four digits, in parentheses where the old text was. */
export function toHex(text) {
  const parts = String(text).replace(/[()]/g, "").split(",").map(Number);
  const all = parts.length === 1 ? [parts[0], parts[0], parts[0]] : parts;
  if (all.length !== 3 || all.some((x) => !Number.isFinite(x))) return null;
  return "#" + all.map((x) => Math.round(encode(Math.min(1, Math.max(0, x))) * 255).toString(16).padStart(2, "0")).join("");
}

export function fromHex(hex, old) {
  const text = [1, 3, 5].map((i) => short(decode(parseInt(hex.slice(i, i + 2), 16) / 255), 4)).join(",");
  return String(old).includes("(") ? `(${text.replaceAll(",", ", ")})` : text;
}
