/* Cuts a long path into chunks with levels of detail; prints the error of each level over its tolerance as JSON. */

import { chunks } from "../source/detail.js";

const COUNT = 50_001;
const path = { tolerance: 1e-3, cutting_speed: 100 };
for (const name of ["x", "y", "z", "speed"]) path[name] = new Float32Array(COUNT);
for (let i = 0; i < COUNT; i += 1) {
  const turn = i / 40;
  path.x[i] = 100 * Math.cos(turn) + 0.01 * Math.sin(7 * i);
  path.y[i] = 100 * Math.sin(turn);
  path.z[i] = i / 500;
  path.speed[i] = 50 + 40 * Math.sin(i / 900);
}

/* The greatest distance of a point that a level leaves out from the segment drawn instead. */
function farthest({ index }) {
  let most = 0;
  for (let k = 0; k + 1 < index.length; k += 1) {
    const [a, b] = [index[k], index[k + 1]].map((i) => [path.x[i], path.y[i], path.z[i]]);
    const way = b.map((value, n) => value - a[n]), square = way.reduce((sum, value) => sum + value * value, 0);
    for (let i = index[k] + 1; i < index[k + 1]; i += 1) {
      const to = [path.x[i], path.y[i], path.z[i]].map((value, n) => value - a[n]);
      const t = square > 0 ? Math.min(Math.max(to.reduce((sum, value, n) => sum + value * way[n], 0) / square, 0), 1) : 0;
      most = Math.max(most, Math.hypot(...to.map((value, n) => value - t * way[n])));
    }
  }
  return most;
}

const found = [...chunks(path)].map(({ centre, radius, levels }) => ({
  ends: [levels[0].index[0], levels[0].index.at(-1)],
  outside: Math.max(...[...levels[0].index].map((i) => Math.hypot(path.x[i] - centre[0], path.y[i] - centre[1], path.z[i] - centre[2]))) - radius,
  levels: levels.map((level) => ({ tolerance: level.tolerance, points: level.index.length, off: farthest(level), ends: [level.index[0], level.index.at(-1)] })),
}));
process.stdout.write(JSON.stringify({ count: COUNT, chunks: found }));
