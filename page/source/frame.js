/* The box around a tool path with ticks, drawn flat over the picture: three of its edges have numbers. */

import { shown } from "./numbers.js";
import { style } from "./theme.js";

const NEAREST = 70; // pixels between two ticks, about
const AXES = ["X", "Y", "Z"];

/* `project` takes a place [mm] to pixels; `low` and `high` are opposite corners of the box. */
export function drawFrame(context, project, low, high) {
  const ink = style("--soft"), faint = style("--faint");
  context.font = `12px ${getComputedStyle(document.body).fontFamily}`;
  context.lineWidth = 1;
  const corner = (bits) => [0, 1, 2].map((k) => (bits & (1 << k) ? high[k] : low[k]));
  for (let axis = 0; axis < 3; axis += 1) {
    const others = [0, 1, 2].filter((k) => k !== axis);
    const edges = [0, 1, 2, 3].map((n) => {
      const bits = (n & 1 ? 1 << others[0] : 0) | (n & 2 ? 1 << others[1] : 0);
      return [project(corner(bits)), project(corner(bits | (1 << axis))), corner(bits)];
    });
    const [from, to] = edges[0];
    const size = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (!(size > 24) || !(high[axis] > low[axis])) continue;
    context.strokeStyle = faint;
    for (const [a, b] of edges) line(context, a, b);
    const isSteep = Math.abs(to[1] - from[1]) > 2 * Math.abs(to[0] - from[0]);
    const middle = ([a, b]) => (isSteep ? -(a[0] + b[0]) : a[1] + b[1]);
    const lowest = edges.reduce((best, edge) => (middle(edge) > middle(best) ? edge : best));
    ticks(context, lowest, axis, low[axis], high[axis], size, isSteep, ink, project);
  }
}

function ticks(context, [a, b, start], axis, low, high, size, isSteep, ink, project) {
  const step = tidy(((high - low) * NEAREST) / size);
  context.fillStyle = context.strokeStyle = ink;
  line(context, a, b);
  context.textBaseline = "middle";
  const away = isSteep ? [-1, 0] : [0, 1];
  context.textAlign = isSteep ? "right" : "center";
  const text = (words, [x, y], distance) => context.fillText(words, x + away[0] * distance, y + away[1] * (distance + 2));
  for (let value = Math.ceil(low / step - 1e-9) * step; value <= high + 1e-9 * step; value += step) {
    const place = [...start];
    place[axis] = value;
    const at = project(place);
    line(context, at, [at[0] + 5 * away[0], at[1] + 5 * away[1]]);
    text(shown(Math.abs(value) < 1e-9 * step ? 0 : value), at, 10);
  }
  context.font = context.font.replace(/^/, "bold ");
  text(`${AXES[axis]} [mm]`, [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], isSteep ? 44 : 28);
  context.font = context.font.replace("bold ", "");
}

/* The nearest of 1, 2, 5 times a power of ten that is not below. */
function tidy(step) {
  const power = 10 ** Math.floor(Math.log10(step));
  return power * ([1, 2, 5].find((factor) => factor * power >= step * (1 - 1e-9)) ?? 10);
}

function line(context, [x0, y0], [x1, y1]) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}
