/* Draws the box around a tool path over the picture; three of its edges have ticks with numbers. */

import { shown } from "./numbers.js";
import { font, style } from "./theme.js";

const NEAREST = 48; // approximate least distance of two ticks in pixels
const AXES = ["X", "Y", "Z"];

/* `project` maps a point [mm] to pixels; `low` and `high` are opposite corners of the box; `isNarrow` leaves out
   the units of the axes. */
export function drawFrame(context, project, low, high, isNarrow) {
  const ink = style("--soft"), faint = style("--faint");
  context.font = font(12);
  context.lineWidth = 1;
  const corner = (bits) => [0, 1, 2].map((k) => (bits & (1 << k) ? high[k] : low[k]));
  const nearest = Math.min(...[0, 1, 2, 3, 4, 5, 6, 7].map((bits) => project(corner(bits))[2]));
  const centre = project(low.map((value, k) => (value + high[k]) / 2));
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
    // The edges at the corner nearest to the viewer are left out, because they would cross the path.
    for (const [a, b] of edges) if (Math.min(a[2], b[2]) > nearest + 1e-6) line(context, a, b);
    const isSteep = Math.abs(to[1] - from[1]) > 2 * Math.abs(to[0] - from[0]);
    const middle = ([a, b]) => (isSteep ? -(a[0] + b[0]) : a[1] + b[1]);
    const lowest = edges.reduce((best, edge) => (middle(edge) > middle(best) ? edge : best));
    ticks(context, lowest, axis, low[axis], high[axis], size, away(lowest, centre), ink, project, isNarrow);
  }
}

function ticks(context, [a, b, start], axis, low, high, size, [ax, ay], ink, project, isNarrow) {
  const step = tidy(((high - low) * NEAREST) / size);
  context.fillStyle = context.strokeStyle = ink;
  line(context, a, b);
  context.textBaseline = "middle";
  context.textAlign = "center";
  const text = (words, [x, y], distance) => {
    const far = distance + (Math.abs(ax) * context.measureText(words).width) / 2;
    context.fillText(words, x + ax * far, y + ay * far);
  };
  for (let value = Math.ceil(low / step - 1e-9) * step; value <= high + 1e-9 * step; value += step) {
    const point = [...start];
    point[axis] = value;
    const at = project(point);
    line(context, at, [at[0] + 5 * ax, at[1] + 5 * ay]);
    text(shown(Math.abs(value) < 1e-9 * step ? 0 : value), at, 13);
  }
  context.font = `bold ${font(12)}`;
  text(`${AXES[axis]}${isNarrow ? "" : " [mm]"}`, [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], isNarrow ? 28 : 34);
  context.font = font(12);
}

/* The unit vector at right angles to an edge that points away from the middle of the box. */
function away([a, b], centre) {
  const x = a[1] - b[1], y = b[0] - a[0], size = Math.hypot(x, y) || 1;
  const side = x * (a[0] - centre[0]) + y * (a[1] - centre[1]) < 0 ? -1 : 1;
  return [(side * x) / size, (side * y) / size];
}

/* The least number 1, 2 or 5 times a power of ten that is not below the value. */
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
