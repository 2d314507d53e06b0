/* Draws a tool path on a canvas without WebGL: successive points of equal colour are one line. */

import { NONE } from "./modes.js";

const STEPS = 48; // number of colours of a scale
const MOST = 60000; // greatest number of points that are drawn

/* `levels` are those of `detail.js`, `colours` CSS colours; a value is from 0 to 1, or the number of a kind. */
export function drawFlat(context, path, levels, project, { values, isKind }, colours, none, width) {
  const every = Math.ceil(levels.reduce((sum, { index }) => sum + index.length, 0) / MOST);
  context.lineJoin = "round";
  let last = null;
  const finish = () => last !== null && context.stroke();
  for (const { index } of levels) {
    finish();
    last = null;
    for (let i = 0; i + 1 < index.length; i += every) {
      const a = index[i], b = index[Math.min(i + every, index.length - 1)];
      const value = values[b];
      const step = value === NONE ? NONE : isKind ? value : Math.round(value * (STEPS - 1));
      if (step !== last) {
        finish();
        context.beginPath();
        context.strokeStyle = step === NONE ? none : colours[isKind ? step : Math.round((step / (STEPS - 1)) * (colours.length - 1))];
        context.lineWidth = step === NONE ? width / 2 : width;
        context.moveTo(...project([path.x[a], path.y[a], path.z[a]]));
        last = step;
      }
      context.lineTo(...project([path.x[b], path.y[b], path.z[b]]));
    }
  }
  finish();
}
