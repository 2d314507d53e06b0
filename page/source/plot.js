/* One chart of curves over a common axis: zoomed by dragging, pointed at, and set to a place from outside. */

import uPlot from "uplot";

import { grid, sampled } from "./curve.js";
import { shown } from "./numbers.js";
import { font, style, wash } from "./theme.js";
import { touch } from "./touch.js";

const AXIS = 64; // pixels of the numbers at the left
const LATE = 200; // [ms]

export class Plot {
  #plot = null;
  #bands = [];
  #columns = 0;
  #place = null;
  #isPointing = false;

  /* `onZoom(range)` is told the range that is asked for, null for all; `onPoint(x)` where the pointer is. Both are
     also of touch. */
  constructor(container, { height, label, onZoom, onPoint }) {
    this.container = container;
    Object.assign(this, { height, label, onZoom, onPoint });
    this.hidden = new Set();
    new ResizeObserver(() => this.#hasNewWidth() && this.draw()).observe(container);
  }

  /* What is drawn: `curves` of { name, curve, colour, width, dash, fill, isLimit, scale,
     none (the value from which there is none) }, `ends` of the x axis,
     the `range` of the y axis, `lines` across of { value, colour } and `marks` of { x } down. */
  show({ curves, ends, range, unit, lines = [], marks = [] }) {
    Object.assign(this, { curves, ends, range, unit, lines, marks });
    this.draw();
  }

  /* Shows a part of the x axis, null: all. */
  zoom(range) {
    this.shownRange = range;
    this.draw();
  }

  /* Points at a place of the x axis; null: nowhere. */
  point(x) {
    this.#place = x;
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
    const data = [grid(from, to, this.#columns), ...found.map((one) => one.y)];
    this.#plot = new uPlot(this.#options(width, from, to, found), data, this.container);
    if (this.#place !== null) this.point(this.#place);
    this.#drawAgain();
  }

  /* The first texts on a canvas can be missing (Chromium without a graphics processor, under load): their glyphs
     come late. All is there when it is drawn again. */
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
    const read = (u, values) => values.map((value) => shown(value, 6));
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

  /* A range was dragged over. uPlot ends its own work on that before the chart is drawn anew. */
  #selected(u) {
    const { left, width } = u.select;
    if (width > 4) queueMicrotask(() => this.onZoom([u.posToVal(left, "x"), u.posToVal(left + width, "x")]));
  }

  /* The pointer has moved; where it has left, the place that it had stays. */
  #pointed(u) {
    if (u.cursor.left < 0) return queueMicrotask(() => this.point(this.#place));
    this.#isPointing = true;
    this.onPoint(u.posToVal(u.cursor.left, "x"));
    this.#isPointing = false;
  }

  /* A value in the legend; nothing where the curve or the pointer is not. */
  #read({ none = Infinity }, value) {
    if (value === null || Number.isNaN(value)) return "";
    return value < none ? `${shown(value)} ${this.unit}` : "none";
  }

  /* Straight lines across (limits) and down (where a limit is broken). */
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
      const place = u.valToPos(x, "x", true);
      if (place >= bbox.left && place <= bbox.left + bbox.width) stroke(ctx, place, bbox.top, place, bbox.top + bbox.height);
    }
    ctx.restore();
  }

  /* What a curve fills that oscillates faster than pixels. */
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
