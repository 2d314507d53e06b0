/* A planned program as it is drawn: the tool's position by time, length and source line. */

import { lastUpTo } from "./numbers.js";

export class Run {
  /* `path` is the tool path of `ToolPath.data` in Python. */
  constructor(path) {
    this.path = path;
    this.count = path.x.length;
    this.duration = this.count ? path.time[this.count - 1] : 0;
    this.length = this.count ? path.length[this.count - 1] : 0;
    this.unit = path.unit;
  }

  /* The number of the point at or before a time [s]. */
  at(time) {
    return lastUpTo(this.path.time, time);
  }

  /* The position [mm] at a time, interpolated between two points of the path. */
  position(time) {
    const { x, y, z } = this.path;
    const i = this.at(time), j = Math.min(i + 1, this.count - 1), t = this.#part(this.path.time, i, j, time);
    return [x, y, z].map((values) => values[i] + t * (values[j] - values[i]));
  }

  lengthAt(time) {
    return this.#moved(this.path.time, this.path.length, time);
  }

  timeAt(length) {
    return this.#moved(this.path.length, this.path.time, length);
  }

  speedAt(time) {
    return this.#moved(this.path.time, this.path.speed, time);
  }

  /* The source line at a time, which is the line of the next point. */
  lineAt(time) {
    return this.count ? this.path.line[Math.min(this.at(time) + 1, this.count - 1)] : 0;
  }

  /* The first time [s] at which a source line is reached; null if the line has no motion. */
  timeOfLine(line) {
    const i = this.path.line.indexOf(line);
    return i < 0 ? null : this.path.time[Math.max(i - 1, 0)];
  }

  #part(list, i, j, value) {
    const span = list[j] - list[i];
    return span > 0 ? Math.min(Math.max((value - list[i]) / span, 0), 1) : 0;
  }

  #moved(from, to, value) {
    if (!this.count) return 0;
    const i = lastUpTo(from, value), j = Math.min(i + 1, this.count - 1);
    return to[i] + this.#part(from, i, j, value) * (to[j] - to[i]);
  }
}
