/* Draws the charts of the report. */
"use strict";
(() => {
  const { data, element, style, axisColour, config, flatTools, layout, axis, title, greatest, curveTraces, wash, refines } = charts;

  /* Rapids much faster than cutting would flatten the rest: they run out of the charts of speed. */
  const { top_speed: topSpeed, cutting_speed: cuttingSpeed } = data.length;
  const hidesRapids = topSpeed > 1.5 * cuttingSpeed;
  const { unit } = data.path;
  const shownSpeed = (hidesRapids ? cuttingSpeed : topSpeed) || 1;
  const toolPath = pathChart({ path: data.path, top: cuttingSpeed, failures: data.failures });

  /* Speed and limits over length ----------------------------------------------------------------- */
  const LIMITS = {
    acceleration: ["axis accelerations (limit curve)", "--axis-0", "solid"],
    velocity: ["axis velocities", "--axis-4", "dash"],
    feed: ["feed", "--axis-3", "dash"],
    chord: ["chord error", "--axis-5", "dot"],
  };
  function drawLength(from = -Infinity, to = Infinity) {
    const traces = [];
    const pixels = element("length").clientWidth;
    const top = 1.25 * shownSpeed;
    for (const [name, [label, colour, dash]] of Object.entries(LIMITS)) {
      if (!data.length[name]) continue;
      const more = { name: label, line: { dash } };
      traces.push(...curveTraces(data.length[name], from, to, { colour, width: 1.1, pixels, more, isLimit: true, top, unit: `${unit}/s` }));
    }
    const more = { name: "planned speed", fill: "tozeroy", fillcolor: wash("--accent", 0.12) };
    traces.push(...curveTraces(data.length.speed, from, to, { colour: "--accent", width: 2, pixels, more, unit: `${unit}/s` }));
    const chart = element("length");
    const old = chart.layout;
    Plotly.react(chart, traces, layout({
      margin: { l: 64, r: 20, t: 34, b: 46 }, hovermode: "x unified", dragmode: "zoom", uirevision: "length",
      legend: { orientation: "h", traceorder: "normal", x: 0, y: 1.02, yanchor: "bottom", font: { size: 13 } },
      xaxis: axis({ title: title(`path length [${unit}]`), ...(old && Number.isFinite(from) ? { range: [from, to] } : {}) }),
      yaxis: axis({ title: title(`speed [${unit}/s]`), range: old ? old.yaxis.range : [0, top] }),
    }), { ...config, ...flatTools });
  }

  /* Axes over time ------------------------------------------------------------------------------- */
  const units = [...new Set(data.units)];
  /* 500, or -300..500 where a limit differs by direction. */
  const sided = (name, k) => {
    const [most, least] = [data.limits[name][k], (data.least[name] || [])[k]];
    return [...(least && least !== -most ? [least] : []), most].map((limit) => Number(limit.toPrecision(6))).join("..");
  };
  const ROWS = [["speed", `${unit}/s`], ...[["velocity", "s"], ["acceleration", "s²"], ["jerk", "s³"]]
    .map(([name, per]) => [name, units.map((own) => `${own}/${per}`).join(", ")])];
  const tops = Object.fromEntries(ROWS.slice(1).map(([name]) => [name, data.time[name].map((c) => greatest(c.y))]));
  /* What is no limit may have lone spikes; they run out of the chart rather than flatten it. */
  const usual = Object.fromEntries(ROWS.slice(1).map(([name]) => [name, data.time[name].map((c, k) => {
    const sorted = Float32Array.from(c.y, Math.abs).sort();
    const common = 2 * (sorted[Math.floor(0.98 * sorted.length)] || 0);
    return common > 0 ? Math.min(tops[name][k], common) : tops[name][k];
  })]));
  let relative = false;
  function drawTime(from = -Infinity, to = Infinity) {
    const traces = [];
    const shapes = [];
    const annotations = [];
    const form = {};
    const pixels = element("time").clientWidth;
    const isNarrow = pixels < 700;
    const gap = 0.045;
    const height = (1 - gap * (ROWS.length - 1)) / ROWS.length;
    ROWS.forEach(([name, unit], row) => {
      const id = row === 0 ? "y" : `y${row + 1}`;
      const bottom = 1 - (row + 1) * height - row * gap;
      let range;
      if (name === "speed") {
        const more = { name: "speed", yaxis: id, showlegend: false, fill: "tozeroy", fillcolor: wash("--accent", 0.12) };
        traces.push(...curveTraces(data.time.speed, from, to, { colour: "--accent", width: 1.6, pixels, more, unit }));
        range = [0, (hidesRapids ? 1.25 : 1.1) * shownSpeed];
      } else {
        const limits = data.limits[name];
        const percent = relative && limits.every((limit) => limit);
        const scale = limits.map((limit) => (percent ? 100 / limit : 1));
        let top = 0;
        data.time[name].forEach((curve, k) => {
          const more = { name: data.axes[k], legendgroup: data.axes[k], yaxis: id, showlegend: name === "velocity" };
          const colour = `--axis-${k % 9}`;
          traces.push(...curveTraces(curve, from, to, { colour, scale: scale[k], pixels, more, unit: percent ? "%" : unit }));
          top = Math.max(top, (data.judged.includes(name) ? tops : usual)[name][k] * scale[k]);
        });
        /* A limit far outside would squeeze the curves: it is named beside the chart and drawn only when near. */
        const least = data.least[name] || limits.map((limit) => limit && -limit);
        const ends = [...limits, ...least].map((limit, k) => limit && limit * scale[k % limits.length]);
        const lines = [...new Set(ends)].filter((v) => v && Math.abs(v) <= 2 * top);
        const reach = Math.max(top, ...lines.map(Math.abs)) * 1.08 || 1;
        range = [-reach, reach];
        for (const value of lines) {
          const owners = ends.map((end, k) => (end === value ? k % limits.length : -1)).filter((k) => k >= 0);
          const colour = owners.length > 1 ? style("--soft") : axisColour(owners[0]);
          shapes.push({ type: "line", xref: "paper", x0: 0, x1: 1, yref: id, y0: value, y1: value, line: { color: colour, width: 1, dash: "dash" } });
        }
      }
      const limits = data.limits[name];
      const known = limits ? limits.map((limit, k) => (limit ? `${data.axes[k]} ${sided(name, k)}` : null)).filter(Boolean) : [];
      const shownUnit = relative && limits && limits.every(Boolean) ? "% of limit" : unit;
      const rapids = name === "speed" && hidesRapids && !isNarrow ? `rapids up to ${Number(topSpeed.toPrecision(4))} ${data.path.unit}/s run out of the chart` : "";
      const note = rapids ? rapids : !known.length || isNarrow ? "" : data.judged.includes(name) ? `limits ${known.join(", ")} ${unit}` : `not limited by this method (machine: ${known.join(", ")} ${unit})`;
      annotations.push({
        xref: "paper", yref: "paper", x: 0, y: bottom + height, xanchor: "left", yanchor: "bottom", showarrow: false,
        text: `<b>${name}</b> [${shownUnit}]&nbsp; ${note}`, font: { size: 13, color: style("--soft") },
      });
      form[row === 0 ? "yaxis" : `yaxis${row + 1}`] = axis({ domain: [bottom, bottom + height - 0.012], range, zeroline: true, zerolinecolor: style("--faint"), nticks: 6 });
    });
    for (const failure of data.failures) {
      if (!Number.isFinite(failure.time)) continue;
      const row = ROWS.findIndex(([name]) => name === failure.name);
      shapes.push({ type: "line", xref: "x", x0: failure.time, x1: failure.time, yref: row > 0 ? `y${row + 1} domain` : "y domain", y0: 0, y1: 1, line: { color: style("--bad"), width: 1.5, dash: "dot" } });
    }
    Plotly.react("time", traces, layout({
      ...form, shapes, annotations, margin: { l: 64, r: 20, t: 30, b: 46 }, hovermode: "x unified", hoversubplots: "axis", dragmode: "zoom",
      legend: { orientation: "h", traceorder: "normal", x: 1, xanchor: "right", y: 1 - height - gap, yanchor: "bottom", font: { size: 13 } },
      xaxis: axis({ title: title("time [s]"), anchor: `y${ROWS.length}`, range: Number.isFinite(from) ? [from, to] : [0, data.duration || 1] }),
    }), { ...config, ...flatTools });
  }

  /* Use of the limits, where the method keeps them all --------------------------------------------- */
  const USED = ["velocity", "acceleration", "jerk"];
  const usesAll = data.judged.includes("jerk") && data.limits.jerk.some(Boolean);
  function drawUse(from = -Infinity, to = Infinity) {
    if (!usesAll) return;
    element("use-section").hidden = false;
    const traces = [];
    const shapes = [];
    const annotations = [];
    const form = {};
    const pixels = element("use").clientWidth;
    const gap = 0.06;
    const height = (1 - gap * (USED.length - 1)) / USED.length;
    USED.forEach((name, row) => {
      const id = row === 0 ? "y" : `y${row + 1}`;
      const bottom = 1 - (row + 1) * height - row * gap;
      data.time[name].forEach((curve, k) => {
        const limit = data.limits[name][k];
        if (!limit) return;
        const more = { name: data.axes[k], legendgroup: data.axes[k], yaxis: id, showlegend: name === "velocity" };
        traces.push(...curveTraces(curve, from, to, { colour: `--axis-${k % 9}`, scale: 1 / limit, pixels, more, unit: "of its limit" }));
      });
      for (const y of [1, -1]) {
        shapes.push({ type: "line", xref: "paper", x0: 0, x1: 1, yref: id, y0: y, y1: y, line: { color: style("--soft"), width: 1, dash: "dash" } });
      }
      annotations.push({
        xref: "paper", yref: "paper", x: 0, y: bottom + height, xanchor: "left", yanchor: "bottom", showarrow: false,
        text: `<b>${name}</b> / limit`, font: { size: 13, color: style("--soft") },
      });
      form[row === 0 ? "yaxis" : `yaxis${row + 1}`] = axis({ domain: [bottom, bottom + height - 0.012], range: [-1.12, 1.12], zeroline: true, zerolinecolor: style("--faint"), tickvals: [-1, -0.5, 0, 0.5, 1] });
    });
    Plotly.react("use", traces, layout({
      ...form, shapes, annotations, margin: { l: 64, r: 20, t: 52, b: 46 }, hovermode: "x unified", hoversubplots: "axis", dragmode: "zoom",
      legend: { orientation: "h", traceorder: "normal", x: 1, xanchor: "right", y: 1, yanchor: "bottom", font: { size: 13 } },
      xaxis: axis({ title: title("time [s]"), anchor: `y${USED.length}`, range: Number.isFinite(from) ? [from, to] : [0, data.duration || 1] }),
    }), { ...config, ...flatTools });
  }

  function drawAll() {
    toolPath.draw();
    drawLength();
    drawTime();
    drawUse();
  }
  element("scaling").addEventListener("click", (event) => {
    if (!event.target.dataset.relative) return;
    relative = event.target.dataset.relative === "yes";
    for (const button of element("scaling").children) {
      button.setAttribute("aria-pressed", String((button.dataset.relative === "yes") === relative));
    }
    drawTime();
  });
  drawAll();
  refines("length", drawLength);
  refines("time", drawTime);
  if (usesAll) refines("use", drawUse);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);

  /* Paper is light and narrow, and has no WebGL. */
  const PAPER = { path: 400, length: 320, time: 860, ...(usesAll ? { use: 640 } : {}) };
  addEventListener("beforeprint", () => {
    document.documentElement.classList.add("printing");
    toolPath.draw(true);
    drawLength();
    drawTime();
    drawUse();
    for (const [id, height] of Object.entries(PAPER)) Plotly.relayout(id, { width: 670, height });
  });
  addEventListener("afterprint", () => {
    document.documentElement.classList.remove("printing");
    for (const id of Object.keys(PAPER)) Plotly.relayout(id, { width: null, height: null, autosize: true });
    drawAll();
  });
})();
