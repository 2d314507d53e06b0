/* Levels of detail of a tool path: each has fewer points than the one before and a wider tolerance [mm]. */

import { extent } from "./numbers.js";

const COARSER = 4; // tolerance of a level over that of the one before
const FEWEST = 4000; // no level with fewer points is worth its memory

/* The levels of a path, the finest first: { tolerance, index }, where `index` are numbers of points. */
export function levels(path) {
  const count = path.x.length;
  const speedWeight = weightOfSpeed(path);
  let level = { tolerance: path.tolerance, index: new Uint32Array(count).map((_, i) => i) };
  const found = [level];
  let cost = new Float32Array(count);
  while (level.index.length > FEWEST) {
    const tolerance = (level.tolerance || 1e-6) * COARSER;
    const thinned = thin(path, level.index, cost, tolerance, speedWeight);
    if (thinned.index.length > 0.9 * level.index.length) {
      if (tolerance > 1e6 * (path.tolerance || 1e-6)) break;
      level = { tolerance, index: level.index };
      continue;
    }
    level = { tolerance, index: thinned.index };
    cost = thinned.cost;
    found.push(level);
  }
  return found;
}

/* A hundredth of the top speed weighs like a ten-thousandth of the extent, as in `report/tool_path.py`. */
function weightOfSpeed({ x, y, z, cutting_speed: top }) {
  let square = 0;
  for (const values of [x, y, z]) {
    const [low, high] = extent(values);
    square += (high - low) ** 2;
  }
  return top > 0 ? (0.01 * Math.sqrt(square)) / top : 0;
}

/* Every second point is a candidate; it goes when it lies within the tolerance of the line between its
   neighbours, what earlier removals have cost added up. */
function thin(path, index, cost, tolerance, speedWeight) {
  let gone = 1, parity = 1, idle = 0;
  while (idle < 2 && index.length > 2) {
    const kept = new Uint32Array(index.length), spent = new Float32Array(index.length);
    let size = 0;
    gone = 0;
    for (let i = 0; i < index.length; i += 1) {
      const isCandidate = i % 2 === parity && i > 0 && i < index.length - 1;
      if (isCandidate) {
        const total = Math.max(cost[i - 1], cost[i]) + off(path, speedWeight, index[i], index[i - 1], index[i + 1]);
        if (total <= tolerance) {
          spent[size - 1] = total;
          gone += 1;
          continue;
        }
      }
      kept[size] = index[i];
      spent[size] = cost[i];
      size += 1;
    }
    idle = gone <= index.length / 50 ? idle + 1 : 0;
    index = kept.slice(0, size);
    cost = spent.slice(0, size);
    parity = 1 - parity;
  }
  return { index, cost };
}

/* Distance of the point i from the segment from a to b, speed as a fourth coordinate. */
function off({ x, y, z, speed }, w, i, a, b) {
  const bx = x[b] - x[a], by = y[b] - y[a], bz = z[b] - z[a], bs = w * (speed[b] - speed[a]);
  const px = x[i] - x[a], py = y[i] - y[a], pz = z[i] - z[a], ps = w * (speed[i] - speed[a]);
  const square = bx * bx + by * by + bz * bz + bs * bs;
  const t = square > 0 ? Math.min(Math.max((px * bx + py * by + pz * bz + ps * bs) / square, 0), 1) : 0;
  return Math.hypot(px - t * bx, py - t * by, pz - t * bz, ps - t * bs);
}
