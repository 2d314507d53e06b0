/* Sliders for the feed, the tolerance and a limit of an axis; moving one has the program planned again. */

import { duration, shown } from "../numbers.js";
import { element } from "../parts.js";
import { planned } from "./job.js";
import { LIMITS, described, scaled } from "./machine_file.js";

const PAUSE = 120; // time that a slider must rest before planning starts [ms]

/* The factor at a position of a slider, from 1/4 to 4; 1 (as planned) at position 0. */
const factorAt = (position) => 2 ** (position / 50);
const SLIDERS = {
  feed: { label: "Feed override", shown: (position) => `${shown(100 * factorAt(position), 3)} %` },
  tolerance: { label: "Tolerance", shown: (position, what) => (position === 0 ? "as planned" : `${shown(what.tolerance * factorAt(2 * position), 2)} mm`) },
  limit: { label: "Limit of", shown: (position) => `${shown(100 * factorAt(position), 3)} %` },
};

export class WhatIf {
  #base = null;
  #axes = [];
  #wait = 0;
  #isDue = false;
  #stop = null;

  /* `onPlan(plan, words)` is called with each new plan, and with null if all sliders are at 0. */
  constructor(container, onPlan) {
    Object.assign(this, { onPlan });
    this.sliders = {};
    for (const [name, { label }] of Object.entries(SLIDERS)) {
      const row = container.appendChild(element("label", "slider"));
      const head = row.appendChild(element("span", "", label));
      if (name === "limit") this.limit = head.appendChild(element("select"));
      const value = row.appendChild(element("output"));
      const input = row.appendChild(element("input"));
      Object.assign(input, { type: "range", min: -100, max: 100, value: 0, step: 1, name });
      input.addEventListener("input", () => this.#changed());
      input.addEventListener("change", () => this.#soon(0));
      input.addEventListener("dblclick", () => this.#set(name, 0));
      this.sliders[name] = { input, value };
    }
    this.limit.ariaLabel = "Limit of an axis";
    this.limit.addEventListener("change", () => this.#changed());
    const foot = container.appendChild(element("div", "foot"));
    this.told = foot.appendChild(element("output", "told"));
    this.back = foot.appendChild(element("button", "", "as planned"));
    this.back.type = "button";
    this.back.addEventListener("click", () => this.reset());
  }

  /* Sets the plan that the sliders change. */
  async show(plan) {
    this.#base = plan;
    this.quiet();
    this.tolerance = plan.order.options.tolerance ?? plan.summary.tolerance?.greatest ?? 0.01;
    const { axes } = await described(plan.order.machine);
    if (this.#base !== plan) return;
    this.#axes = axes;
    const options = axes.flatMap((axis) => Object.entries(LIMITS).filter(([key]) => axis[key] !== null).map(([key, name]) => new Option(`${axis.name} ${name}`, `${axis.name} ${key}`)));
    const chosen = this.limit.value;
    this.limit.replaceChildren(...options);
    if (options.some((option) => option.value === chosen)) this.limit.value = chosen;
  }

  reset() {
    this.quiet();
    this.onPlan(null);
  }

  /* Sets all sliders to 0. */
  quiet() {
    this.#stop?.abort();
    clearTimeout(this.#wait);
    this.#isDue = false;
    for (const { input } of Object.values(this.sliders)) input.value = 0;
    this.told.textContent = "Move a slider: the program is planned again at once.";
    this.#tell();
  }

  #set(name, position) {
    this.sliders[name].input.value = position;
    this.#changed();
  }

  #tell() {
    for (const [name, { input, value }] of Object.entries(this.sliders)) value.textContent = SLIDERS[name].shown(Number(input.value), this);
    this.back.disabled = Object.values(this.sliders).every(({ input }) => Number(input.value) === 0);
  }

  #changed() {
    this.#tell();
    if (!this.#base) return;
    if (this.back.disabled) return this.reset();
    this.#stop?.abort();
    this.#isDue = true;
    this.#soon(PAUSE);
  }

  /* Plans with the changes after `pause` ms. */
  #soon(pause) {
    clearTimeout(this.#wait);
    if (this.#isDue) this.#wait = setTimeout(() => this.#plan(), pause);
  }

  async #plan() {
    this.#isDue = false;
    const stop = (this.#stop = new AbortController());
    this.told.textContent = "planning …";
    try {
      const { order, words } = await this.#order();
      if (stop.signal.aborted) return;
      const plan = await planned(order, { signal: stop.signal, onProgress: (stage, done) => (this.told.textContent = `${stage} … ${Math.round(100 * done)} %`) });
      if (stop.signal.aborted) return;
      const before = this.#base.summary.time, after = plan.summary.time;
      this.told.textContent = `${duration(after)}, ${after <= before ? "−" : "+"}${shown((100 * Math.abs(after - before)) / before, 3)} %${plan.summary.audit.ok ? "" : " — audit FAILED"}`;
      this.onPlan(plan, words);
    } catch (error) {
      if (!stop.signal.aborted) this.told.textContent = error.message;
    }
  }

  async #order() {
    const { order } = this.#base;
    const position = (name) => Number(this.sliders[name].input.value);
    const options = { ...order.options }, words = [];
    let { machine } = order;
    if (position("feed")) {
      options.feed_override = (options.feed_override ?? 1) * factorAt(position("feed"));
      words.push(`feed ${SLIDERS.feed.shown(position("feed"))}`);
    }
    if (position("tolerance")) {
      options.tolerance = Number((this.tolerance * factorAt(2 * position("tolerance"))).toPrecision(3));
      words.push(`tolerance ${SLIDERS.tolerance.shown(position("tolerance"), this)}`);
    }
    if (position("limit")) {
      const [axis, key] = this.limit.value.split(" ");
      const limit = this.#axes.find(({ name }) => name === axis)[key];
      machine = (await described(machine, { [axis]: { [key]: scaled(limit, factorAt(position("limit"))) } })).file;
      words.push(`${axis} ${LIMITS[key]} ${SLIDERS.limit.shown(position("limit"))}`);
    }
    return { order: { ...order, machine, options }, words: words.join(", ") };
  }
}
