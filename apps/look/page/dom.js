/** The element of this id. */
export const byId = (id) => document.getElementById(id);

/** An element with attributes (or properties, where the name begins with a dot; listeners, where with "on") and children. */
export function make(tag, attributes = {}, ...children) {
  return fill(document.createElement(tag), attributes, children);
}

/** The same of SVG. */
export function makeSvg(tag, attributes = {}, ...children) {
  return fill(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);
}

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name.startsWith(".")) element[name.slice(1)] = value;
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

/** "edge-thickness" as a label. */
export function labelOf(name) {
  const text = name.replaceAll("-", " ").replaceAll("_", " ");
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** A number with at most so many significant digits, never as 1e-7. */
export function short(number, digits = 5) {
  return String(Number(Number(number.toPrecision(digits)).toFixed(8)));
}

/** Follows a pointer that went down on `element` until it goes up: start(event) returns false where it is not wanted. */
export function follow(element, { start, move, end }) {
  element.addEventListener("pointerdown", (event) => {
    if (start(event) === false) return;
    event.preventDefault();
    element.setPointerCapture(event.pointerId);
    element.focus({ preventScroll: true });
    const moved = (now) => now.pointerId === event.pointerId && move(now);
    const ended = (now) => {
      if (now.pointerId !== event.pointerId) return;
      element.removeEventListener("pointermove", moved);
      for (const kind of ["pointerup", "pointercancel"]) element.removeEventListener(kind, ended);
      end?.(now);
    };
    element.addEventListener("pointermove", moved);
    for (const kind of ["pointerup", "pointercancel"]) element.addEventListener(kind, ended);
  });
}
