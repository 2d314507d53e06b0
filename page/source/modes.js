/* What the colours of a tool path tell: for each mode a value at every point, and a legend. */

import { css, kindColour } from "./colours.js";
import { extent, shown } from "./numbers.js";

export const NONE = -1; // no value here: drawn thin and grey

/* Each mode makes of a path { values, scale, ends } or, for kinds, { values, colours, kinds }: values from 0 to 1
   on the scale, the texts at its ends; or the number of the kind. */
export const MODES = {
  speed: { label: "planned speed", of: (path) => scaled(path, path.speed, path.cutting_speed, "viridis") },
  feed: { label: "programmed feed", of: (path) => scaled(path, path.feed, extent(path.feed)[1], "viridis") },
  active: { label: "active limit", of: activeLimit },
  lost: { label: "time lost", of: timeLost },
};

/* Rapids have no feed and would flatten the scale: they have no value, unless there is nothing else. */
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

/* What is known at a point, in words. */
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
