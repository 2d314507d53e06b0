/* Small elements of a page. */

import { shown } from "./numbers.js";

export function element(tag, kind = "", text = "") {
  const made = document.createElement(tag);
  if (kind) made.className = kind;
  if (text) made.textContent = text;
  return made;
}

/* Buttons of which one is pressed; `names` maps names to texts. `press` marks the one of a name. */
export function choice(names, label, onChoose) {
  const box = element("div", "choice");
  box.setAttribute("role", "group");
  box.setAttribute("aria-label", label);
  for (const [name, text] of Object.entries(names)) {
    const button = element("button", "", text);
    button.type = "button";
    button.dataset.name = name;
    button.addEventListener("click", () => onChoose(name));
    box.append(button);
  }
  const press = (chosen) => {
    for (const button of box.children) button.setAttribute("aria-pressed", String(button.dataset.name === chosen));
  };
  return { box, press };
}

/* The head of a chart: a quantity, its unit and a note. */
export function heading(name, unit, note = "") {
  return [element("b", "", name), ` [${unit}]  ${note}`];
}

/* A note if rapids are faster than `reach`, the greatest speed on a chart with the scale of the cutting speeds. */
export function rapidsBeyond(reach, top, unit) {
  return top > reach ? `rapids up to ${shown(top)} ${unit} run out of the chart` : "";
}
