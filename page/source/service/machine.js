/* The machine that a program is planned on: chosen by name, its limits edited in a table or as a whole file. */

import { element } from "../parts.js";
import { json } from "./api.js";
import { LIMITS, axesOf, withLimit } from "./machine_text.js";

const AUTO = "auto";

export class MachineChoice {
  #known = {};
  #text = null; // of an edited machine

  constructor(select, table, text) {
    Object.assign(this, { select, table, text });
    select.addEventListener("change", () => this.#choose());
    text.addEventListener("input", () => {
      this.#text = text.value;
      this.#mark();
      this.#fill();
    });
  }

  async load() {
    const { machines } = await json("/v1/machines");
    this.select.replaceChildren(option(AUTO, "the smallest that the program fits"));
    for (const machine of machines) {
      this.#known[machine.name] = machine.file;
      this.select.append(option(machine.name, machine.name));
    }
    this.select.value = "mill" in this.#known ? "mill" : AUTO;
    this.#choose();
  }

  /* What is sent: a name, or the text of a machine file. */
  get order() {
    return this.#text ?? this.select.value;
  }

  /* The whole text, empty for the one that is still to be chosen. */
  get whole() {
    return this.#text ?? this.#known[this.select.value] ?? "";
  }

  /* Takes over the text of a machine, as of a job that was opened. */
  take(text) {
    const name = Object.keys(this.#known).find((known) => this.#known[known] === text);
    if (name) {
      this.select.value = name;
      this.#choose();
      return;
    }
    this.#text = text;
    this.#mark();
    this.#fill();
  }

  #choose() {
    this.#text = null;
    this.select.querySelector("[value=edited]")?.remove();
    this.#fill();
  }

  /* Says that the machine is none of those that are known. */
  #mark() {
    if (!this.select.querySelector("[value=edited]")) this.select.append(option("edited", "edited"));
    this.select.value = "edited";
  }

  #fill() {
    if (document.activeElement !== this.text) this.text.value = this.whole;
    const axes = axesOf(this.whole);
    this.table.hidden = !axes.length;
    const head = element("tr");
    head.append(element("th", "", "Axis"), ...Object.values(LIMITS).map((name) => element("th", "n", name)), element("th", "", "unit"));
    const rows = axes.map((axis) => {
      const row = element("tr");
      row.append(element("td", "", axis.name));
      for (const key of Object.keys(LIMITS)) row.append(this.#cell(axis, key));
      row.append(element("td", "soft", `${axis.unit}, s`));
      return row;
    });
    this.table.replaceChildren(head, ...rows);
  }

  #cell(axis, key) {
    const cell = element("td", "n");
    const input = cell.appendChild(element("input"));
    Object.assign(input, { value: axis[key] ?? "", inputMode: "decimal", ariaLabel: `${axis.name} ${LIMITS[key]}` });
    input.addEventListener("change", () => {
      this.#text = withLimit(this.whole, axis.name, key, input.value.trim());
      this.#mark();
      this.#fill();
    });
    return cell;
  }
}

function option(value, text) {
  const made = element("option", "", text);
  made.value = value;
  return made;
}
