/* The machine for planning: chosen by name, and edited as a table of limits or as a file. */

import { numbersIn } from "../numbers.js";
import { element } from "../parts.js";
import { json } from "./api.js";
import { LIMITS, described, written } from "./machine_file.js";

const AUTO = "auto", EDITED = "edited";
const PAUSE = 300; // time from the last keystroke to the request [ms]

export class MachineChoice {
  #known = {};
  #text = null; // the file of an edited machine
  #info = null; // the service's description of the machine; null if none is chosen
  #wait = 0;

  /* `told` is the element that shows errors in an edited machine. */
  constructor(select, table, text, told) {
    Object.assign(this, { select, table, text, told });
    select.addEventListener("change", () => this.#choose());
    text.addEventListener("input", () => {
      this.#edited(text.value);
      clearTimeout(this.#wait);
      this.#wait = setTimeout(() => this.#ask(text.value), PAUSE);
    });
  }

  async load() {
    const { machines } = await json("/v1/machines");
    this.select.replaceChildren(new Option("the smallest that the program fits", AUTO));
    for (const machine of machines) {
      this.#known[machine.name] = machine;
      this.select.append(new Option(machine.name, machine.name));
    }
    this.select.value = "mill" in this.#known ? "mill" : AUTO;
    this.#choose();
  }

  /* The machine as requests name it: a name, or the text of a machine file. */
  get order() {
    return this.#text ?? this.select.value;
  }

  /* Sets the text of a machine, such as that of an opened job. */
  take(text) {
    const name = Object.keys(this.#known).find((known) => this.#known[known].file === text);
    if (name) {
      this.select.value = name;
      this.#choose();
      return;
    }
    this.#edited(text);
    this.text.value = text;
    this.#ask(text);
  }

  #choose() {
    this.#text = null;
    this.#info = this.#known[this.select.value] ?? null;
    this.select.querySelector(`[value=${EDITED}]`)?.remove();
    this.told.textContent = "";
    this.text.value = this.#info?.file ?? "";
    this.#fill();
  }

  /* Sets the text of a machine file, and shows that the machine is not one of the bundled ones. */
  #edited(text) {
    this.#text = text;
    if (!this.select.querySelector(`[value=${EDITED}]`)) this.select.append(new Option(EDITED, EDITED));
    this.select.value = EDITED;
  }

  /* Asks the service for the machine with these limits and shows it, or shows the error. */
  async #ask(machine, limits = {}) {
    const before = this.order;
    try {
      const info = await described(machine, limits);
      if (this.order !== before) return; // the machine has been edited again
      this.#info = info;
      this.told.textContent = "";
      if (Object.keys(limits).length) {
        this.#edited(info.file);
        this.text.value = info.file;
      }
      this.#fill();
    } catch (error) {
      if (this.order === before) this.told.textContent = error.message;
    }
  }

  #fill() {
    const axes = this.#info?.axes ?? [];
    this.table.hidden = !axes.length;
    const head = element("tr");
    head.append(element("th", "", "Axis"), ...Object.values(LIMITS).map((name) => element("th", "n", name)));
    const rows = axes.map((axis) => {
      const row = element("tr");
      const name = row.appendChild(element("td", "", axis.name));
      name.append(element("small", "", axis.unit));
      for (const key of Object.keys(LIMITS)) row.append(this.#cell(axis, key));
      return row;
    });
    this.table.replaceChildren(head, ...rows);
  }

  #cell(axis, key) {
    const cell = element("td", "n");
    const input = cell.appendChild(element("input"));
    Object.assign(input, { value: written(axis[key]), inputMode: "decimal", placeholder: "none", ariaLabel: `${axis.name} ${LIMITS[key]}` });
    input.addEventListener("change", () => this.#ask(this.order, { [axis.name]: { [key]: numbersIn(input.value) } }));
    return cell;
  }
}
