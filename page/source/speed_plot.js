/* The planned speed and its limits over the length of the path, and the speed of another run. */

import { element, heading, rapidsBeyond } from "./parts.js";
import { Plot } from "./plot.js";

const LIMITS = {
  acceleration: ["axis accelerations (limit curve)", "--limit-0", undefined],
  velocity: ["axis velocities", "--limit-1", [8, 4]],
  feed: ["feed", "--limit-2", [8, 4]],
  chord: ["chord error", "--limit-3", [2, 3]],
};

export class SpeedPlot {
  /* `cursor` holds a time; the run converts it to the length at that time. */
  constructor(container, data, run, cursor) {
    this.run = run;
    this.data = data;
    const { unit } = data.path;
    const box = container.appendChild(element("div", "row"));
    this.head = box.appendChild(element("p"));
    this.plot = new Plot(box, {
      height: 330,
      label: `path length [${unit}]`,
      onZoom: (range) => this.plot.zoom(range),
      onPoint: (length) => cursor.set(run.timeAt(length), this),
    });
    this.end = cursor.follow((time) => this.plot.point(time === null ? null : run.lengthAt(time)));
    this.show();
  }

  /* Draws; `other` is another plan of the same program: its run, its data and its name. */
  show(other = null) {
    const { length, path } = this.data;
    const { top_speed: top, cutting_speed: cutting } = length;
    // The chart has the scale of the cutting speeds; much faster rapids are cut off at its top.
    const reach = 1.25 * ((top > 1.5 * cutting ? cutting : top) || 1);
    const curves = Object.entries(LIMITS)
      .filter(([name]) => length[name])
      .map(([name, [label, colour, dash]]) => ({ name: label, curve: length[name], colour, dash, width: 1.2, isLimit: true, none: 19.9 * top || Infinity }));
    if (other) {
      const scale = other.run.length > 0 ? this.run.length / other.run.length : 1;
      const { x, y, mean } = other.data.length.speed;
      const curve = { x: x.map((value) => value * scale), y, mean: { x: mean.x.map((value) => value * scale), y: mean.y } };
      curves.push({ name: other.name, curve, colour: "--other", width: 1.6, dash: [6, 3] });
    }
    curves.push({ name: "planned speed", curve: length.speed, colour: "--accent", width: 2, fill: true });
    const unit = `${path.unit}/s`;
    this.head.replaceChildren(...heading("speed", unit, rapidsBeyond(reach, top, unit)));
    this.plot.show({ curves, ends: [0, this.run.length || 1], range: [0, reach], unit });
  }

  draw() {
    this.plot.draw();
  }
}
