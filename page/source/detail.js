/* Levels of detail of a tool path. The path is cut into chunks of consecutive points. Each chunk has levels, the
   finest first; each next level has fewer points and a greater tolerance [mm]. */

import { extent } from "./numbers.js";

const POINTS = 16384; // points of a chunk
const COARSER = 4; // ratio of the tolerances of successive levels
const FEWEST = 128; // a level with at most this number of points has no coarser one
const WIDEST = 0.02; // greatest tolerance, as a share of the extent of the path

/* Yields the chunks of a path: { centre, radius, levels }; a level is { tolerance, index }, where `index` are
   numbers of points. The last point of a chunk is the first point of the next. */
export function* chunks(path) {
  const size = Math.hypot(...[path.x, path.y, path.z].map((values) => span(extent(values))));
  // An error of 1e-2 of the top speed counts like one of 1e-4 of the extent, as in `report/tool_path.py`.
  const weight = path.cutting_speed > 0 ? (0.01 * size) / path.cutting_speed : 0;
  const count = path.x.length;
  for (let first = 0; first + 1 < count; first += POINTS) {
    const index = Uint32Array.from({ length: Math.min(POINTS, count - 1 - first) + 1 }, (_, i) => first + i);
    yield { ...ball(path, index), levels: levels(path, index, weight, WIDEST * size) };
  }
}

const span = ([low, high]) => high - low;

/* A sphere around the points from the first to the last one of `index`. */
function ball({ x, y, z }, index) {
  const ends = [x, y, z].map((values) => extent(values.subarray(index[0], index.at(-1) + 1)));
  return { centre: ends.map(([low, high]) => (low + high) / 2), radius: Math.hypot(...ends.map(span)) / 2 };
}

function levels(path, index, weight, widest) {
  const found = [{ tolerance: path.tolerance, index }];
  let cost = new Float32Array(index.length);
  for (let tolerance = COARSER * path.tolerance; tolerance < widest && index.length > FEWEST; tolerance *= COARSER) {
    const thinned = thin(path, index, cost, tolerance, weight);
    if (thinned.index.length > 0.9 * index.length) continue;
    ({ index, cost } = thinned);
    found.push({ tolerance, index });
  }
  return found;
}

/* Removes points in passes: in each, every second point is removed if its distance from the line between its
   neighbours, plus the error of earlier removals there (`cost`), is within the tolerance. */
function thin(path, index, cost, tolerance, weight) {
  let gone = 1, parity = 1, idle = 0;
  while (idle < 2 && index.length > 2) {
    const kept = new Uint32Array(index.length), spent = new Float32Array(index.length);
    let size = 0;
    gone = 0;
    for (let i = 0; i < index.length; i += 1) {
      if (i % 2 === parity && i > 0 && i < index.length - 1) {
        const total = Math.max(cost[i - 1], cost[i]) + off(path, weight, index[i], index[i - 1], index[i + 1]);
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

/* Distance of the point i from the segment from a to b, with the speed times w as a fourth coordinate. */
function off({ x, y, z, speed }, w, i, a, b) {
  const bx = x[b] - x[a], by = y[b] - y[a], bz = z[b] - z[a], bs = w * (speed[b] - speed[a]);
  const px = x[i] - x[a], py = y[i] - y[a], pz = z[i] - z[a], ps = w * (speed[i] - speed[a]);
  const square = bx * bx + by * by + bz * bz + bs * bs;
  const t = square > 0 ? Math.min(Math.max((px * bx + py * by + pz * bz + ps * bs) / square, 0), 1) : 0;
  const dx = px - t * bx, dy = py - t * by, dz = pz - t * bz, ds = ps - t * bs;
  return Math.sqrt(dx * dx + dy * dy + dz * dz + ds * ds);
}
