/* Chooses what a plan is compared with: a controller of today or another method. The settings of a controller come
   from the machine file if it names this controller, else they are the controller's defaults; each can be changed. */

import { numbersIn } from "../numbers.js";
import { element } from "../parts.js";
import { json } from "./api.js";
import { described, written } from "./machine_file.js";

const OF_ALL = ["tolerance", "feed", "feed_override"]; // options that every method takes

export class Today {
  #controllers = {};
  #methods = [];
  #plan = null;
  #own = null; // the controller of the machine file
  #given = {}; // parameters that the user has changed here

  /* `onChoice()` is called when the choice or a setting has changed. */
  constructor(select, table, onChoice) {
    Object.assign(this, { select, table });
    select.addEventListener("change", () => {
      this.#given = {};
      this.#fill();
      onChoice();
    });
    table.addEventListener("change", ({ target }) => {
      this.#given[target.name] = target.value.trim();
      this.#fill();
      onChoice();
    });
  }

  async load() {
    const [{ controllers }, { methods }] = await Promise.all([json("/v1/controllers"), json("/v1/methods")]);
    for (const controller of controllers) this.#controllers[controller.name] = controller;
    this.#methods = methods.map(({ name }) => name);
  }

  /* Sets the plan to compare; nothing is chosen yet. */
  async show(plan) {
    this.#plan = plan;
    this.#own = null;
    this.#options();
    const { controller } = await described(plan.order.machine);
    if (this.#plan !== plan) return;
    this.#own = controller;
    this.#options();
  }

  /* Removes the choice. */
  clear() {
    this.select.value = "";
    this.#given = {};
    this.#fill();
  }

  /* The plan to make for the comparison, { order, words }; null if nothing is chosen. */
  get order() {
    const { order } = this.#plan, name = this.select.value;
    if (!name) return null;
    const common = Object.fromEntries(OF_ALL.filter((key) => key in order.options).map((key) => [key, order.options[key]]));
    const controller = this.#controllers[name];
    if (!controller) return { order: { ...order, method: name, options: common }, words: name };
    const options = { ...common, ...controller.options };
    for (const { option, value } of this.#settings()) if (value !== null) options[option] = value;
    const words = name === this.#own?.name ? `${name} (machine file)` : name;
    return { order: { ...order, method: controller.method, options }, words };
  }

  #options() {
    const group = (label, names) => {
      const made = element("optgroup");
      made.label = label;
      made.append(...names.map((name) => new Option(name === this.#own?.name ? `${name} (machine file)` : name, name)));
      return made;
    };
    const names = Object.keys(this.#controllers).sort((a, b) => (b === this.#own?.name) - (a === this.#own?.name));
    const others = this.#methods.filter((name) => name !== this.#plan.order.method);
    this.select.replaceChildren(new Option("nothing", ""), group("My controller today", names), group("Another method", others));
    this.clear();
  }

  /* The parameters of the chosen controller: { name, option, unit, value (null: no limit), from }. */
  #settings() {
    const name = this.select.value, own = name === this.#own?.name ? this.#own.parameters : {};
    return Object.entries(this.#controllers[name]?.parameters ?? {}).map(([key, parameter]) => {
      const [value, from] = this.#given[key] ? [numbersIn(this.#given[key]), "given here"] : key in own ? [own[key], "machine file"] : [parameter.default, "default"];
      return { name: key, ...parameter, value, from };
    });
  }

  #fill() {
    const rows = this.#settings().map(({ name, unit, value, from }) => {
      const row = element("tr"), cell = element("td", "n");
      const input = cell.appendChild(element("input"));
      Object.assign(input, { name, value: written(value), placeholder: "none", inputMode: "decimal", ariaLabel: name });
      row.append(element("td", "", name.replaceAll("_", " ")), cell, element("td", "soft", unit), element("td", "soft", from));
      return row;
    });
    this.table.hidden = !rows.length;
    this.table.replaceChildren(...rows);
  }
}
