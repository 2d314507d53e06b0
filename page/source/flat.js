/* A tool path on a canvas without WebGL: neighbours of like colour are one line. */

import { NONE } from "./modes.js";

const STEPS = 48; // colours told apart on a scale
const MOST = 60000; // points drawn

/* `points` are numbers of points of `path`; `colours` are texts, `value` is 0 to 1 or the number of a kind. */
export function drawFlat(context, path, points, project, { values, isKind }, colours, none, width) {
  const every = Math.ceil(points.length / MOST);
  context.lineJoin = "round";
  let last = null;
  const finish = () => last !== null && context.stroke();
  for (let i = every; i < points.length; i += every) {
    const value = values[points[i]];
    const step = value === NONE ? NONE : isKind ? value : Math.round(value * (STEPS - 1));
    const a = points[i - every], b = points[i];
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
  finish();
}
