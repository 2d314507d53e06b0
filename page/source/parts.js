/* Small parts of a page. */

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
