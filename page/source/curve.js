/* Reduces a curve of any number of points to two values for each column of pixels. */

import { lastUpTo } from "./numbers.js";

/* Reduces the part of a curve { x, y, mean } between `from` and `to` to two values for each column of pixels: the
   extremes in their order, so that no peak is lost. If the curve oscillates faster than the pixels, the values are
   its mean, and `low` and `high` its extremes; of such a limit only the least values are drawn. `top` is the greatest
   value that the chart shows. */
export function sampled(curve, from, to, columns, { isLimit = false, top = Infinity, scale = 1 } = {}) {
  const low = new Float64Array(2 * columns), high = new Float64Array(2 * columns), y = new Float64Array(2 * columns);
  const step = (to - from) / columns;
  let variation = 0, least = Infinity, most = -Infinity, before = NaN;
  let i = lastUpTo(curve.x, from);
  for (let k = 0; k < columns; k += 1) {
    // The last column is longer: the end of the curve may be beyond `to` by the rounding of sums.
    const start = from + k * step, end = start + (k + 1 < columns ? step : 2 * step);
    while (i + 1 < curve.x.length && curve.x[i + 1] <= start) i += 1;
    const first = at(curve, i, start);
    let a = first, b = first, aIsFirst = true, j = i;
    while (j + 1 < curve.x.length && curve.x[j + 1] < end) {
      j += 1;
      const value = curve.y[j];
      if (value < a || Number.isNaN(a)) [a, aIsFirst] = [value, false];
      if (value > b || Number.isNaN(b)) [b, aIsFirst] = [value, true];
    }
    [y[2 * k], y[2 * k + 1]] = aIsFirst ? [a, b] : [b, a];
    if (j === i) y[2 * k + 1] = at(curve, i, start + step / 2);
    low[2 * k] = low[2 * k + 1] = Math.min(a, y[2 * k + 1]);
    high[2 * k] = high[2 * k + 1] = Math.max(b, y[2 * k + 1]);
    for (const value of [Math.min(y[2 * k], top), Math.min(y[2 * k + 1], top)]) {
      if (Number.isFinite(value)) {
        if (Number.isFinite(before)) variation += Math.abs(value - before);
        least = Math.min(least, value);
        most = Math.max(most, value);
        before = value;
      }
    }
  }
  const scaled = (values) => (scale === 1 ? values : values.map((value) => value * scale));
  const isDense = variation > 0.5 * columns * (most - least) && most > least;
  if (!isDense) return { y: scaled(y) };
  if (isLimit) return { y: scaled(low) };
  const { mean } = curve;
  for (let k = 0; k < 2 * columns; k += 1) {
    const x = from + (k * step) / 2;
    y[k] = mean ? at(mean, lastUpTo(mean.x, x), x) : (low[k] + high[k]) / 2;
  }
  return { y: scaled(y), low: scaled(low), high: scaled(high) };
}

/* The value at the x `here`, between the points i and i + 1; NaN outside of the curve. */
function at({ x, y }, i, here) {
  const last = x.length - 1;
  if (last < 0 || here < x[0] || here > x[last]) return NaN;
  if (i >= last) return y[last];
  const span = x[i + 1] - x[i];
  return span > 0 ? y[i] + ((here - x[i]) / span) * (y[i + 1] - y[i]) : y[i + 1];
}

/* The x of the two values of each column. */
export function grid(from, to, columns) {
  return Float64Array.from({ length: 2 * columns }, (_, k) => from + ((to - from) * k) / (2 * columns));
}

export function greatest(values) {
  let top = 0;
  for (const value of values) if (Math.abs(value) > top) top = Math.abs(value);
  return top;
}
