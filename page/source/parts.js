/* Small parts of a page. */

import { shown } from "./numbers.js";

export function element(tag, kind = "", text = "") {
  const made = document.createElement(tag);
  if (kind) made.className = kind;
  if (text) made.textContent = text;
  return made;
}

/* Buttons of which one is pressed; `names` are the names with their texts. */
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

/* The note on rapids that are faster than the `reach` of a chart, which is scaled by the cutting speeds. */
export function rapidsBeyond(reach, top, unit) {
  return top > reach ? `rapids up to ${shown(top)} ${unit} run out of the chart` : "";
}
