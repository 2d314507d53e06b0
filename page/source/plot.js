/* A chart of curves over a common x axis: dragging zooms, the pointer and other views set a cursor. */

import uPlot from "uplot";

import { grid, sampled } from "./curve.js";
import { shown, tick } from "./numbers.js";
import { font, style, wash } from "./theme.js";
import { touch } from "./touch.js";

const AXIS = 64; // width in pixels of the numbers at the left, of at most nine characters
const LATE = 200; // time until a chart is drawn again [ms]

export class Plot {
  #plot = null;
  #bands = [];
  #columns = 0;
  #cursor = null;
  #isPointing = false;

  /* `onZoom(range)` gets the new range, null for the whole axis; `onPoint(x)` gets the x of the pointer. Touch calls
     both too. The legend is beside the heading if it has at most `mostBeside` names. */
  constructor(container, { height, label, onZoom, onPoint, mostBeside = 0 }) {
    this.container = container;
    Object.assign(this, { height, label, onZoom, onPoint, mostBeside });
    this.hidden = new Set();
    new ResizeObserver(() => this.#hasNewWidth() && this.draw()).observe(container);
  }

  /* Draws `curves` of { name, curve, colour, width, dash, fill, isLimit, scale, none }; from the value `none` on the
     legend shows "none". `ends` are those of the x axis, `range` is that of the y axis; `lines` of { value, colour }
     are horizontal, `marks` of { x } vertical. */
  show({ curves, ends, range, unit, lines = [], marks = [] }) {
    Object.assign(this, { curves, ends, range, unit, lines, marks });
    this.draw();
  }

  /* Shows a part of the x axis; null shows all of it. */
  zoom(range) {
    this.shownRange = range;
    this.draw();
  }

  /* Sets the cursor to an x; null removes it. */
  point(x) {
    this.#cursor = x;
    if (!this.#plot || this.#isPointing) return;
    const left = x === null ? -10 : this.#plot.valToPos(x, "x");
    this.#plot.setCursor({ left, top: x === null ? -10 : 0 }, false);
  }

  draw() {
    if (!this.curves || !this.container.clientWidth) return;
    this.#plot?.destroy();
    const width = this.container.clientWidth;
    this.#columns = Math.max(Math.round(width - AXIS), 50);
    const [from, to] = this.#range();
    const found = this.curves.map(({ curve, ...options }) => sampled(curve, from, to, this.#columns, { ...options, top: this.range[1] }));
    this.#bands = found;
    // The name of a curve with a range is twice as long.
    this.container.classList.toggle("beside", found.length + found.filter((one) => one.low).length <= this.mostBeside);
    const data = [grid(from, to, this.#columns), ...found.map((one) => one.y)];
    this.#plot = new uPlot(this.#options(width, from, to, found), data, this.container);
    if (this.#cursor !== null) this.point(this.#cursor);
    this.#drawAgain();
  }

  /* Draws the chart again after LATE: the first texts on a canvas can be missing, because their glyphs are loaded late
     (Chromium without a graphics processor, under load). */
  #drawAgain() {
    const plot = this.#plot;
    setTimeout(() => plot === this.#plot && plot.redraw(false, false), LATE);
  }

  #range() {
    const [from, to] = this.shownRange ?? this.ends;
    return to > from ? [from, to] : [from, from + 1];
  }

  #hasNewWidth() {
    return this.#plot && this.#plot.width !== this.container.clientWidth;
  }

  #options(width, from, to, found) {
    const axis = { stroke: style("--soft"), grid: { stroke: style("--grid"), width: 1 }, ticks: { show: false }, font: font(12) };
    const read = (u, values) => values.map(tick);
    return {
      width,
      height: this.height + (this.label ? 46 : 22),
      padding: [8, 22, 0, 0],
      scales: { x: { time: false, range: [from, to] }, y: { range: this.range } },
      cursor: { drag: { x: true, y: false, setScale: false }, points: { size: 6 }, bind: { dblclick: () => () => this.onZoom(null) }, y: false },
      legend: { live: true, markers: { width: 0, fill: (u, k) => style(this.curves[k - 1].colour) } },
      axes: [
        { ...axis, values: read, label: this.label, labelSize: this.label ? 24 : 0, size: 22, labelFont: axis.font },
        { ...axis, values: read, size: AXIS, space: 26 },
      ],
      series: [
        { label: this.label ?? "", value: (u, value) => shown(value, 6) },
        ...this.curves.map((one, k) => ({
          label: found[k].low ? `${one.name}, mean and range` : one.name,
          stroke: style(one.colour),
          width: one.width ?? 1.2,
          dash: one.dash,
          fill: one.fill && !found[k].low ? wash(one.colour, 0.12) : undefined,
          points: { show: false },
          show: !this.hidden.has(one.name),
          value: (u, value) => this.#read(one, value),
        })),
      ],
      hooks: {
        drawAxes: [(u) => this.#drawLines(u)],
        drawSeries: [(u, k) => k > 0 && this.#drawBand(u, k)],
        setSeries: [(u, k, { show }) => show !== undefined && k && this.hidden[show ? "delete" : "add"](this.curves[k - 1].name)],
        setSelect: [(u) => this.#selected(u)],
        setCursor: [(u) => u.cursor.event && this.#pointed(u)],
      },
      plugins: [touch((range) => this.onZoom(range), () => this.ends, (x) => this.onPoint(x))],
    };
  }

  /* Called after dragging over a range. The chart is drawn again after uPlot has finished its own work. */
  #selected(u) {
    const { left, width } = u.select;
    if (width > 4) queueMicrotask(() => this.onZoom([u.posToVal(left, "x"), u.posToVal(left + width, "x")]));
  }

  /* Called when the pointer has moved; when it leaves the chart the cursor stays. */
  #pointed(u) {
    if (u.cursor.left < 0) return queueMicrotask(() => this.point(this.#cursor));
    this.#isPointing = true;
    this.onPoint(u.posToVal(u.cursor.left, "x"));
    this.#isPointing = false;
  }

  /* A value in the legend; empty without a value or a pointer. */
  #read({ none = Infinity }, value) {
    if (value === null || Number.isNaN(value)) return "";
    return value < none ? `${shown(value)} ${this.unit}` : "none";
  }

  /* Horizontal lines (limits) and vertical lines (where a limit is broken). */
  #drawLines(u) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
    for (const { value, colour } of this.lines) {
      ctx.strokeStyle = colour;
      stroke(ctx, bbox.left, u.valToPos(value, "y", true), bbox.left + bbox.width, u.valToPos(value, "y", true));
    }
    ctx.strokeStyle = style("--bad");
    for (const { x } of this.marks) {
      const across = u.valToPos(x, "x", true);
      if (across >= bbox.left && across <= bbox.left + bbox.width) stroke(ctx, across, bbox.top, across, bbox.top + bbox.height);
    }
    ctx.restore();
  }

  /* Fills the range between the extremes of a curve that oscillates faster than the pixels. */
  #drawBand(u, k) {
    const { low, high } = this.#bands[k - 1];
    if (!low || !u.series[k].show) return;
    const { ctx, bbox } = u;
    const x = u.data[0];
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.fillStyle = wash(this.curves[k - 1].colour, 0.18);
    const step = (bbox.width / low.length) * 2;
    for (let i = 0; i < low.length; i += 2) {
      if (Number.isNaN(low[i])) continue;
      const top = u.valToPos(high[i], "y", true);
      ctx.fillRect(u.valToPos(x[i], "x", true), top, step, u.valToPos(low[i], "y", true) - top);
    }
    ctx.restore();
  }
}

function stroke(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}
