/* The modes of colouring a tool path: for each mode a value at every point, and a legend. */

import { css, kindColour } from "./colours.js";
import { extent, shown } from "./numbers.js";

export const NONE = -1; // a point without a value, which is drawn thin and grey

/* `of` converts a path to { values, scale, ends }, with values from 0 to 1 and the texts at the ends of the scale,
   or to { values, colours, kinds }, with the number of a kind as value. */
export const MODES = {
  speed: { label: "planned speed", of: (path) => scaled(path, path.speed, path.cutting_speed, "viridis") },
  feed: { label: "programmed feed", of: (path) => scaled(path, path.feed, extent(path.feed)[1], "viridis") },
  active: { label: "active limit", of: activeLimit },
  lost: { label: "time lost", of: timeLost },
};

/* Rapids have no value, so that the scale fits the cutting moves, unless all moves are rapids. */
function scaled(path, list, top, scale) {
  const { feed } = path;
  const hasFeed = extent(feed)[1] > 0;
  const values = list.map((value, i) => (hasFeed && feed[i] === 0 ? NONE : Math.min(value / (top || 1), 1)));
  return { values, scale, ends: ["0", `${shown(top)} ${path.unit}/s`], note: hasFeed && values.includes(NONE) ? "rapids in grey" : "" };
}

function activeLimit(path) {
  const count = path.limits.length;
  return {
    values: new Float32Array(path.active),
    colours: path.limits.map((_, k) => kindColour(k, count)),
    kinds: path.limits.map((name, k) => ({ name, colour: css(kindColour(k, count)), isUsed: path.active.includes(k) })).filter((kind) => kind.isUsed),
  };
}

function timeLost(path) {
  return {
    values: new Float32Array(path.lost).map((part) => part / 255),
    scale: "cividis",
    ends: ["0 %", "100 %"],
    note: "of the time there, against the feed and the axis velocities",
  };
}

/* The data of the point i as texts. */
export function told(path, i) {
  const feed = path.feed[i] > 0 ? `feed ${shown(path.feed[i])} ${path.unit}/s` : "rapid";
  return [
    `line ${path.line[i]}`,
    `${shown(path.speed[i])} ${path.unit}/s, ${feed}`,
    path.limits[path.active[i]] ?? "",
    `X ${path.x[i].toFixed(3)}  Y ${path.y[i].toFixed(3)}  Z ${path.z[i].toFixed(3)} mm`,
    `${path.time[i].toFixed(3)} s`,
  ].filter(Boolean);
}
