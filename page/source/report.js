/* The report of one plan. */

import { AxesPlot } from "./axes_plot.js";
import { Cursor } from "./cursor.js";
import { PathView } from "./path_view.js";
import { Run } from "./run.js";
import { SpeedPlot } from "./speed_plot.js";
import { onTheme } from "./theme.js";

const USED = ["velocity", "acceleration", "jerk"];

export function report(data) {
  const at = (id) => document.getElementById(id);
  const run = new Run(data.path), cursor = new Cursor();
  // A machine of joints only, such as a robot, has no path in X, Y, Z.
  const moves = [data.path.x, data.path.y, data.path.z].some((places) => places.some((place) => place !== places[0]));
  if (moves) new PathView(at("path"), at("path-tools"), cursor).show(run);
  else at("path").closest("section").hidden = true;
  const speed = new SpeedPlot(at("length"), data, run, cursor);
  const axes = new AxesPlot(at("time"), data, run, cursor);
  const parts = [speed, axes];
  at("time-tools").append(axes.scaling());
  // The use of the limits is drawn if the method keeps all of them.
  if (data.judged.includes("jerk") && data.limits.jerk.some(Boolean)) {
    at("use-section").hidden = false;
    parts.push(new AxesPlot(at("use"), data, run, cursor, { rows: USED, relative: true }));
  }
  onTheme(() => parts.forEach((part) => part.draw()));
}
