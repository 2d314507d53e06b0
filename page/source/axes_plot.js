/* Charts over time: speed, and velocity, acceleration and jerk of each axis with their limits. */

import { greatest } from "./curve.js";
import { shown } from "./numbers.js";
import { choice, heading, rapidsBeyond } from "./parts.js";
import { Plot } from "./plot.js";
import { axisColour, style } from "./theme.js";

const PER = { velocity: "s", acceleration: "s²", jerk: "s³" };
const HEIGHT = { speed: 120, others: 150 };
/* A legend of at most this many axes is beside their limits, a longer one is below them. */
const MOST_BESIDE = 3;
/* Values below this share of the limit are rounding. */
const ROUNDING = 1e-6;

export class AxesPlot {
  /* `rows` are names of quantities; with `relative` values are drawn in percent of their limits. */
  constructor(container, data, run, cursor, { rows = ["speed", "velocity", "acceleration", "jerk"], relative = false } = {}) {
    Object.assign(this, { data, run, rows, relative });
    this.tops = {};
    for (const name of Object.keys(PER)) this.tops[name] = data.time[name].map((curve, k) => this.#reach(name, curve, k));
    this.plots = rows.map((name, k) => {
      const box = container.appendChild(document.createElement("div"));
      box.className = "row";
      const head = box.appendChild(document.createElement("p"));
      const plot = new Plot(box, {
        height: name === "speed" ? HEIGHT.speed : HEIGHT.others,
        label: k === rows.length - 1 ? "time [s]" : undefined,
        onZoom: (range) => this.plots.forEach(({ plot: one }) => one.zoom(range)),
        onPoint: (time) => cursor.set(time, this),
        mostBeside: MOST_BESIDE,
      });
      return { name, box, head, plot };
    });
    this.end = cursor.follow((time) => this.plots.forEach(({ plot }) => plot.point(time)));
    this.show();
  }

  /* Buttons for units or percent of the limits. */
  scaling() {
    const buttons = choice({ units: "units", parts: "% of limit" }, "Scale", (name) => {
      this.relative = name === "parts";
      this.show();
      buttons.press(name);
    });
    buttons.press("units");
    return buttons.box;
  }

  show() {
    for (const row of this.plots) {
      const shownRow = row.name === "speed" ? this.#speed() : this.#quantity(row.name);
      row.head.replaceChildren(...shownRow.head);
      row.plot.show({ ...shownRow, ends: [0, this.data.duration || 1] });
    }
  }

  draw() {
    this.show();
  }

  /* The greatest value on the scale of a curve. A quantity that the method does not limit may have single high spikes:
     the chart cuts them, but not below the machine's limit. A curve that is 0 up to rounding has the scale of the limit. */
  #reach(name, curve, k) {
    const top = greatest(curve.y), limit = this.data.limits[name][k] || 0;
    if (this.data.judged.includes(name)) return top;
    if (top <= ROUNDING * limit) return limit;
    const sorted = Float32Array.from(curve.y, Math.abs).sort();
    const common = Math.max(2 * (sorted[Math.floor(0.98 * sorted.length)] || 0), limit);
    return common > 0 ? Math.min(top, common) : top;
  }

  #speed() {
    const { length, path, time, failures } = this.data;
    const { top_speed: top, cutting_speed: cutting } = length;
    const reach = (top > 1.5 * cutting ? 1.25 * cutting : 1.1 * top) || 1;
    const unit = `${path.unit}/s`;
    const curves = [{ name: "speed", curve: time.speed, colour: "--accent", width: 1.6, fill: true }];
    const marks = failures.filter((failure) => !PER[failure.name] && Number.isFinite(failure.time)).map(({ time: x }) => ({ x }));
    return { curves, range: [0, reach], unit, marks, head: heading("speed", unit, rapidsBeyond(reach, top, unit)) };
  }

  #quantity(name) {
    const { axes, units, limits: all, least: lows, judged, failures, time } = this.data;
    const limits = all[name], least = lows[name] ?? limits.map((limit) => limit && -limit);
    const inParts = this.relative && limits.some(Boolean);
    const scales = limits.map((limit) => (inParts ? 100 / limit : 1));
    const known = axes.map((_, k) => k).filter((k) => !inParts || limits[k]);
    const unit = inParts ? "%" : [...new Set(units)].map((own) => `${own}/${PER[name]}`).join(", ");
    const curves = known.map((k) => ({ name: axes[k], curve: time[name][k], colour: `--axis-${k % 9}`, scale: scales[k] }));
    const top = Math.max(0, ...known.map((k) => this.tops[name][k] * scales[k]));
    // A limit far above the curves is not drawn, so that the curves keep their scale; its value is beside the chart.
    const ends = [...limits, ...least].map((limit, n) => limit && limit * scales[n % limits.length]);
    const near = [...new Set(ends)].filter((value) => value && Math.abs(value) <= 2 * top);
    const lines = near.map((value) => {
      const owners = new Set(ends.flatMap((end, n) => (end === value ? [n % limits.length] : [])));
      return { value, colour: owners.size > 1 ? style("--soft") : axisColour([...owners][0]) };
    });
    const reach = 1.08 * Math.max(top, ...near.map(Math.abs)) || 1;
    const marks = failures.filter((failure) => failure.name === name && Number.isFinite(failure.time)).map(({ time: x }) => ({ x }));
    return { curves, range: [-reach, reach], unit, lines, marks, head: heading(name, inParts ? "% of limit" : unit, told(this.data, name, judged.includes(name))) };
  }
}

/* The limits of a quantity as text. */
function told({ axes, units, limits, least }, name, isJudged) {
  const known = axes.flatMap((axis, k) => {
    const most = limits[name][k], low = least[name]?.[k];
    if (!most) return [];
    const text = `${axis} ${low && low !== -most ? `${shown(low, 6)}…` : ""}${shown(most, 6)}`;
    return { text, unit: `${units[k]}/${PER[name]}` };
  });
  if (!known.length) return "";
  // Neighbouring axes with the same unit share it: it follows the last of them.
  const list = known.map(({ text, unit }, k) => (known[k + 1]?.unit === unit ? text : `${text} ${unit}`)).join(", ");
  return isJudged ? `limits ${list}` : `not limited by this method (machine: ${list})`;
}
