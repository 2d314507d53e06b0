/* The page of a comparison: the speed of every method, linked to the tool path of the chosen one. */

import { Cursor } from "./cursor.js";
import { greatest } from "./curve.js";
import { choice, element, heading, rapidsBeyond } from "./parts.js";
import { PathView } from "./path_view.js";
import { Plot } from "./plot.js";
import { Run } from "./run.js";
import { onTheme } from "./theme.js";

const ACROSS = { length: "over length", time: "over time" };
/* Colours of the methods after the first: those of the axes except blue ones, which are too similar to the first
   method's. Of the rest the two that are similar to each other come last. */
const OTHERS = ["--axis-0", "--axis-1", "--axis-4", "--axis-6", "--axis-8", "--axis-3"];
const DASHES = [undefined, [2, 3], [8, 4]];

export function comparison(data) {
  const at = (id) => document.getElementById(id);
  const { methods } = data;
  if (!methods.length) return;
  const runs = methods.map((method) => new Run(method));
  const cursor = new Cursor();
  let chosen = 0, across = "length";

  const path = new PathView(at("path"), at("path-tools"), cursor);
  const box = at("speed").appendChild(element("div", "row"));
  const head = box.appendChild(element("p"));
  const speed = new Plot(box, {
    height: 330,
    label: " ",
    onZoom: (range) => speed.zoom(range),
    onPoint: (x) => cursor.set(across === "time" ? x : runs[chosen].timeAt(x), speed),
  });
  cursor.follow((time) => speed.point(time === null ? null : across === "time" ? time : runs[chosen].lengthAt(time)));

  /* The chart has the scale of the cutting speeds; much faster rapids are cut off at its top. */
  const reach = 1.25 * Math.max(...methods.map((method) => method.cutting_speed)) || 1;
  const top = Math.max(...methods.map((method) => greatest(method.speed)));
  function drawSpeed() {
    const { unit } = methods[chosen], perSecond = `${unit}/s`;
    head.replaceChildren(...heading("speed", perSecond, rapidsBeyond(reach, top, perSecond)));
    speed.label = across === "length" ? `path length [${unit}]` : "time [s]";
    const curves = methods.map((method, k) => ({
      name: method.method,
      curve: { x: method[across], y: method.speed },
      colour: k === 0 ? "--accent" : OTHERS[(k - 1) % OTHERS.length],
      width: k === chosen ? 2.2 : 1.3,
      dash: DASHES[Math.floor(Math.max(k - 1, 0) / OTHERS.length) % 3],
    }));
    const ends = [0, Math.max(...runs.map((run) => (across === "length" ? run.length : run.duration))) || 1];
    speed.show({ curves, ends, range: [0, reach], unit: perSecond });
  }

  function choose(name) {
    chosen = Number(name);
    names.press(name);
    path.show(runs[chosen]);
    drawSpeed();
  }

  const names = choice(Object.fromEntries(methods.map((method, k) => [`${k}`, method.method])), "Method whose tool path is shown", choose);
  at("methods").append(names.box);
  const axis = choice(ACROSS, "Horizontal axis", (name) => {
    across = name;
    axis.press(name);
    speed.shownRange = null;
    drawSpeed();
  });
  axis.press(across);
  at("across").append(axis.box);
  choose("0");
  onTheme(drawSpeed);
}
