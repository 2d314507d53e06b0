/* Shows a plan (figures, tool path, player, speed, axes, slow lines, source), and another plan for comparison. */

import { AxesPlot } from "../axes_plot.js";
import { Cursor } from "../cursor.js";
import { duration, shown } from "../numbers.js";
import { element } from "../parts.js";
import { PathView } from "../path_view.js";
import { SpeedPlot } from "../speed_plot.js";
import { onTheme } from "../theme.js";
import { download } from "./api.js";
import { Player } from "./player.js";
import { SourceText } from "./source_text.js";

const FORMATS = ["npz", "csv", "parquet", "json", "halstreamer", "npz-compressed"];
const ENDINGS = { "npz-compressed": "npz", halstreamer: "halstream" };

export class Result {
  /* `at(id)` returns an element of the page. */
  constructor(at) {
    this.at = at;
    this.cursor = new Cursor();
    this.player = new Player(at("player"), this.cursor);
    this.path = new PathView(at("path"), at("path-tools"), this.cursor, {
      onMove: (scene) => this.second && !at("second").hidden && this.second.scene.lookLike(scene),
      onChoice: () => this.#likeFirst(),
    });
    this.source = new SourceText(at("source"), (line) => this.goTo(line));
    this.cursor.follow((time) => this.#follow(time));
    onTheme(() => [this.speed, this.axes].forEach((part) => part?.draw()));
    this.#downloads();
  }

  /* Shows a plan. */
  show(plan) {
    const { at } = this;
    const { data, run } = plan;
    this.plan = plan;
    this.other = null;
    this.speed?.end();
    this.axes?.end();
    at("first-name").textContent = `${duration(plan.summary.time)} · ${plan.job.method}`;
    at("result").hidden = at("right").hidden = false;
    at("second").hidden = true;
    at("speed").replaceChildren();
    at("axes").replaceChildren();
    this.cursor.set(null);
    this.path.show(run);
    this.player.show(run.duration);
    this.speed = new SpeedPlot(at("speed"), data, run, this.cursor);
    this.axes = new AxesPlot(at("axes"), data, run, this.cursor);
    at("axes-tools").replaceChildren(this.axes.scaling());
    this.#slow();
    this.#figures();
    this.source.show(plan.order.program, data.has_lines);
    at("report").href = plan.job.links.report;
  }

  /* Shows another plan of the program beside this one, under a name; null removes it. */
  beside(plan, name = "") {
    const { at } = this;
    this.other = plan;
    at("second").hidden = !plan;
    this.speed.show(plan && { run: plan.run, data: plan.data, name });
    this.#figures(name);
    if (!plan) return this.path.scene.resize();
    plan.run.path.cutting_speed = this.plan.run.path.cutting_speed; // so that both have the same colours
    this.second ??= new PathView(at("second-path"), null, this.cursor, { onMove: (scene) => this.path.scene.lookLike(scene) });
    at("second-name").textContent = `${duration(plan.summary.time)} · ${name}`;
    this.second.modeName = this.path.modeName;
    this.second.show(plan.run);
    this.path.scene.resize();
    this.second.scene.resize();
    this.second.scene.lookLike(this.path.scene);
    this.#follow(this.cursor.time);
  }

  /* Sets the cursor to the time at which a source line begins. */
  goTo(line) {
    const time = this.plan.run.timeOfLine(line);
    this.source.choose(line);
    if (time !== null) this.cursor.set(time, this);
  }

  #likeFirst() {
    if (!this.second || !this.other) return;
    this.second.colour(this.path.modeName);
    this.second.scene.lookLike(this.path.scene);
  }

  #follow(time) {
    const { at, plan, other } = this;
    if (!plan) return;
    const told = ({ run }) => (time === null ? "" : `line ${run.lineAt(time)} · ${shown(run.speedAt(time))} ${run.unit}/s · ${shown(run.lengthAt(time), 5)} ${run.unit}`);
    at("first-told").textContent = told(plan);
    if (other) at("second-told").textContent = told(other);
    if (time !== null) this.source.choose(plan.run.lineAt(time));
  }

  #figures(name = "") {
    const { summary, job } = this.plan;
    const { other } = this;
    const verdict = summary.audit.ok ? "passed" : "FAILED";
    const entries = [
      ["Time", duration(summary.time), summary.today ? `${summary.today.controller}: ${duration(summary.today.time)}` : job.method],
      ["Gap to the bound", summary.audit.ok ? `${shown(100 * (summary.gap ?? 0), 3)} %` : "–", `at least ${duration(summary.lower_bound)}`],
      ["Audit", verdict, summary.audit.ok ? "every limit holds" : job.result.failures[0] ?? "", summary.audit.ok ? "good" : "bad"],
      ["Length", `${shown(summary.length, 5)} ${this.plan.run.unit}`, `mean ${shown(summary.mean_speed)} ${this.plan.run.unit}/s`],
      ["Stops", `${summary.stops}`, `${summary.pieces} pieces`],
    ];
    if (other) {
      const saved = other.summary.time - summary.time;
      const times = `${saved >= 0 ? "+" : "−"}${shown((100 * Math.abs(saved)) / summary.time, 3)} %`;
      entries.push([name, duration(other.summary.time), `${times}${other.summary.audit.ok ? "" : ", audit FAILED"}`, other.summary.audit.ok ? "" : "bad"]);
    }
    this.at("figures").replaceChildren(...entries.map(([label, value, more, kind]) => {
      const box = element("div");
      box.append(element("dt", "", label), element("dd", `long ${kind ?? ""}`, value), element("p", "more", more));
      return box;
    }));
    const warnings = job.result.warnings.map((text) => element("li", "", text));
    this.at("warnings").replaceChildren(...warnings);
  }

  #slow() {
    const { slow } = this.plan.data;
    const head = element("tr");
    head.append(element("th", "n", "Line"), element("th", "n", "Lost"), element("th", "", "Because of"));
    const rows = slow.map((line) => {
      const row = element("tr", "go");
      row.tabIndex = 0;
      const because = element("td", "", line.limit);
      if (line.stops) because.append(" ", element("span", "tag", "stop"));
      if (line.rapid) because.append(" ", element("span", "tag", "rapid"));
      row.append(element("td", "n", `${line.line}`), element("td", "n", duration(line.lost)), because);
      row.addEventListener("click", () => this.goTo(line.line));
      row.addEventListener("keydown", ({ key }) => key === "Enter" && this.goTo(line.line));
      return row;
    });
    this.at("slow").replaceChildren(head, ...rows);
  }

  #downloads() {
    const { at } = this;
    for (const name of FORMATS) at("format").append(element("option", "", name));
    const save = (id, make) => at(id).addEventListener("click", () => {
      const { address, name } = make(this.plan.job);
      download(address, name).catch((error) => (at("told").textContent = error.message));
    });
    const stem = (job) => job.program.name.replace(/\.[^.]*$/, "");
    save("save-setpoints", (job) => {
      const format = at("format").value;
      return { address: `${job.links.setpoints}?format=${format}`, name: `${stem(job)}-setpoints.${ENDINGS[format] ?? format}` };
    });
    save("save-report", (job) => ({ address: job.links.report, name: `${stem(job)}-report.html` }));
    save("save-plan", (job) => ({ address: job.links.result, name: `${stem(job)}-plan.json` }));
    save("save-program", (job) => ({ address: job.links.program, name: job.program.name }));
  }
}

