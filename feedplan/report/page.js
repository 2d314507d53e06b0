/* Draws the charts of the report from the data embedded in the page. */
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent, (_, value) => {
    if (value && typeof value === "object" && (value.f4 !== undefined || value.i4 !== undefined)) {
      const bytes = Uint8Array.from(atob(value.f4 ?? value.i4), (c) => c.charCodeAt(0)).buffer;
      return value.f4 !== undefined ? new Float32Array(bytes) : new Int32Array(bytes);
    }
    return value;
  });
  const element = (id) => document.getElementById(id);
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axisColour = (k) => style(`--axis-${k % 6}`);
  const speedColours = () => style("--speed-scale").match(/#[0-9a-f]{6}/gi);
  const config = { displaylogo: false, responsive: true };
  const flatTools = { modeBarButtons: [["zoom2d", "pan2d", "resetScale2d", "toImage"]] };
  const spatialTools = { modeBarButtons: [["orbitRotation", "pan3d", "zoom3d", "resetCameraDefault3d", "toImage"]] };

  const layout = (more) => ({
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    separators: ".\u202f",
    font: { family: getComputedStyle(document.body).fontFamily, size: 13, color: style("--soft") },
    hoverlabel: { bgcolor: style("--card"), bordercolor: style("--faint"), font: { color: style("--ink") } },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: style("--soft"), activecolor: style("--ink") },
    ...more,
  });
  const axis = (more) => ({
    gridcolor: style("--grid"), linecolor: style("--faint"), zeroline: false, automargin: true,
    ticks: "", exponentformat: "none", separatethousands: true, ...more,
  });
  const title = (text) => ({ text, font: { size: 13, color: style("--soft") }, standoff: 8 });

  const greatest = (values) => {
    let top = 0;
    for (const value of values) if (Math.abs(value) > top) top = Math.abs(value);
    return top;
  };

  /* The points of a curve in [from, to], with one beyond either end. */
  function within({ x, y, line }, from, to) {
    let first = 0, last = x.length;
    while (first + 2 < last && x[first + 1] < from) first += 1;
    while (last - 2 > first && x[last - 2] > to) last -= 1;
    return { x: x.subarray(first, last), y: y.subarray(first, last), line: line && line.subarray(first, last) };
  }

  /* Both extremes of each bucket where there are more points than a line needs. */
  const DRAWN = 4000;
  function thinned({ x, y, line }) {
    const width = Math.ceil((2 * x.length) / DRAWN);
    if (width <= 2) return { x, y, line };
    const pick = [];
    for (let start = 0; start < x.length; start += width) {
      let low = start, high = start;
      for (let i = start; i < Math.min(start + width, x.length); i += 1) {
        if (y[i] < y[low]) low = i;
        if (y[i] > y[high]) high = i;
      }
      pick.push(Math.min(low, high));
      if (low !== high) pick.push(Math.max(low, high));
    }
    return { x: pick.map((i) => x[i]), y: pick.map((i) => y[i]), line: line && pick.map((i) => line[i]) };
  }

  /* More ups and downs than pixels make a solid block: then a band of extremes and the mean say more. */
  const BANDS = 400;
  function isDense({ y }, top, pixels) {
    let way = 0, low = Infinity, high = -Infinity;
    for (let i = 0; i < y.length; i += 1) {
      const value = Math.min(y[i], top);
      if (i) way += Math.abs(value - Math.min(y[i - 1], top));
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
    return way > 0.5 * pixels * (high - low) && high > low;
  }
  function band({ x, y }) {
    const from = x[0], span = x[x.length - 1] - from || 1;
    const low = new Array(BANDS).fill(Infinity), high = new Array(BANDS).fill(-Infinity);
    for (let i = 0; i < x.length; i += 1) {
      const k = Math.min(Math.floor(((x[i] - from) / span) * BANDS), BANDS - 1);
      if (y[i] < low[k]) low[k] = y[i];
      if (y[i] > high[k]) high[k] = y[i];
    }
    const filled = low.map((_, k) => k).filter((k) => high[k] >= low[k]);
    return { x: filled.map((k) => from + ((k + 0.5) / BANDS) * span), low: filled.map((k) => low[k]), high: filled.map((k) => high[k]) };
  }

  /* The traces of one curve: a line, or where it is dense a band with the mean. */
  function curveTraces(curve, from, to, { colour, width = 1.2, scale = 1, pixels, more, isLimit, top = Infinity, unit }) {
    const shown = within(curve, from, to);
    const scaled = (values) => (scale === 1 ? values : Array.from(values, (value) => value * scale));
    const line = (x, y, extra) => ({ type: "scatter", mode: "lines", x, y: scaled(y), ...more, ...extra });
    if (!isDense(shown, top, pixels)) {
      const few = thinned(shown);
      return [line(few.x, few.y, {
        line: { color: style(colour), width, ...more.line }, customdata: few.line && Array.from(few.line),
        hovertemplate: `%{y:.4~g} ${unit}${few.line ? ", line %{customdata}" : ""}`,
      })];
    }
    const { x, low, high } = band(shown);
    if (isLimit) {
      return [line(x, low, { name: `${more.name}, least`, line: { color: style(colour), width, ...more.line }, hovertemplate: `%{y:.4~g} ${unit}` })];
    }
    const mean = within(curve.mean, from, to);
    const bare = { line: { width: 0 }, showlegend: false, fill: "none" };
    return [
      line(x, low, { ...bare, hovertemplate: `%{y:.4~g} ${unit} least` }),
      line(x, high, { ...bare, fill: "tonexty", fillcolor: wash(colour, 0.18), hovertemplate: `%{y:.4~g} ${unit} greatest` }),
      line(mean.x, mean.y, { name: more.legendgroup ? more.name : `${more.name}, mean and range`, line: { color: style(colour), width: 1.4 }, fill: "none", hovertemplate: `%{y:.4~g} ${unit} mean` }),
    ];
  }

  function wash(name, alpha) {
    const colour = style(name);
    const [r, g, b] = [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));
    return `rgba(${r},${g},${b},${alpha})`;
  }

  /* Rapids much faster than cutting would flatten the rest: they run out of the charts of speed. */
  const { top_speed: topSpeed, cutting_speed: cuttingSpeed } = data.length;
  const hidesRapids = topSpeed > 1.5 * cuttingSpeed;
  const shownSpeed = (hidesRapids ? cuttingSpeed : topSpeed) || 1;

  /* Tool path ------------------------------------------------------------------------------------ */
  const path = data.path;
  const topColour = cuttingSpeed || 1;
  const size = (name) => path[name].reduce(([a, b], v) => [Math.min(a, v), Math.max(b, v)], [Infinity, -Infinity]).reduce((a, b) => b - a);
  const EYE = { x: -1.1, y: -1.5, z: 1.1 };
  /* What goes right and what goes up, from x, y, z; `xyz` is the same view as the first one in 3D. */
  const views = {
    xyz: [[0.806, -0.591, 0], [0.301, 0.41, 0.86]],
    xy: [[1, 0, 0], [0, 1, 0]],
    xz: [[1, 0, 0], [0, 0, 1]],
    yz: [[0, 1, 0], [0, 0, 1]],
  };
  const hasWebGL = (() => {
    try {
      const canvas = document.createElement("canvas");
      return Boolean(canvas.getContext("webgl2") || canvas.getContext("webgl"));
    } catch {
      return false;
    }
  })();

  function firstView() {
    const flat = ["x", "y", "z"].map((name) => size(name) <= 1e-6 * (size("x") + size("y") + size("z")));
    if (flat[2]) return "xy";
    if (flat[1]) return "xz";
    if (flat[0]) return "yz";
    return "xyz";
  }

  function colourScale() {
    const colours = speedColours();
    return colours.map((colour, i) => [i / (colours.length - 1), colour]);
  }

  function mixed(part) {
    const colours = speedColours().map((c) => [1, 3, 5].map((i) => parseInt(c.slice(i, i + 2), 16)));
    const at = Math.min(Math.max(part, 0), 1) * (colours.length - 1);
    const i = Math.min(Math.floor(at), colours.length - 2);
    const channel = (k) => Math.round(colours[i][k] + (at - i) * (colours[i + 1][k] - colours[i][k]));
    return `rgb(${channel(0)},${channel(1)},${channel(2)})`;
  }

  const spot = (i) => `line ${path.line[i]}<br>${path.speed[i].toPrecision(4)} mm/s`;

  /* Equal scales on all three axes, and the whole in view: the projection is parallel, so size alone matters. */
  function proportions() {
    const sizes = ["x", "y", "z"].map(size);
    const { clientWidth, clientHeight } = element("path");
    const room = Math.min(1, clientWidth / (1.7 * clientHeight));
    const scale = room * Math.min(2.5 / (Math.hypot(...sizes) || 1), 2.2 / (sizes[2] || 1e-9));
    return { x: Math.max(sizes[0] * scale, 1e-3), y: Math.max(sizes[1] * scale, 1e-3), z: Math.max(sizes[2] * scale, 1e-3) };
  }

  function spatial() {
    const scene = (name) => ({
      title: { text: `${name} [mm]`, font: { size: 12 } }, gridcolor: style("--faint"), zeroline: false,
      backgroundcolor: "rgba(0,0,0,0)", showspikes: false, color: style("--soft"),
    });
    const traces = [{
      type: "scatter3d", mode: "lines", x: path.x, y: path.y, z: path.z,
      line: { color: path.speed, colorscale: colourScale(), cmin: 0, cmax: topColour, width: 4 },
      text: Array.from(path.line, (_, i) => spot(i)), hovertemplate: "%{text}<br>%{x:.3f}, %{y:.3f}, %{z:.3f}<extra></extra>",
      showlegend: false,
    }];
    const marker = (points, size, colour, text) => points.length && traces.push({
      type: "scatter3d", mode: "markers", x: points.map((p) => p[0]), y: points.map((p) => p[1]), z: points.map((p) => p[2]),
      marker: { symbol: "circle", size, color: colour }, text, hovertemplate: "%{text}<extra></extra>", showlegend: false,
    });
    marker(path.x.length ? [[path.x[0], path.y[0], path.z[0]]] : [], 5, style("--ink"), ["start"]);
    marker(path.marks, 8, style("--bad"), data.failures.map((f) => `${f.axis || ""} ${f.name} broken`));
    return [traces, layout({
      margin: { l: 0, r: 0, t: 0, b: 0 },
      scene: {
        aspectmode: "manual", aspectratio: proportions(), xaxis: scene("X"), yaxis: scene("Y"), zaxis: scene("Z"),
        camera: { eye: EYE, projection: { type: "orthographic" } },
      },
    })];
  }

  /* A flat view groups neighbours of like speed: one SVG line a colour. */
  const LEVELS = 24;
  function flat(name) {
    const projected = ([a, b, c]) => path.x.map((x, i) => a * x + b * path.y[i] + c * path.z[i]);
    const onto = ([a, b, c]) => path.marks.map(([x, y, z]) => a * x + b * y + c * z);
    const [across, up] = views[name];
    const [a, b] = [projected(across), projected(up)];
    const groups = Array.from({ length: LEVELS }, () => ({ x: [], y: [], text: [], end: -1 }));
    for (let i = 0; i + 1 < a.length; i += 1) {
      const part = (path.speed[i] + path.speed[i + 1]) / 2 / topColour;
      const group = groups[Math.min(Math.floor(part * LEVELS), LEVELS - 1)];
      if (group.end !== i) {
        if (group.end >= 0) { group.x.push(null); group.y.push(null); group.text.push(""); }
        group.x.push(a[i]); group.y.push(b[i]); group.text.push(spot(i));
      }
      group.x.push(a[i + 1]); group.y.push(b[i + 1]); group.text.push(spot(i + 1));
      group.end = i + 1;
    }
    const traces = groups.map((group, k) => ({
      type: "scatter", mode: "lines", x: group.x, y: group.y, text: group.text,
      hovertemplate: "%{text}<extra></extra>",
      line: { color: mixed((k + 0.5) / LEVELS), width: 2, simplify: true }, showlegend: false, connectgaps: false,
    }));
    const marker = (x, y, symbol, colour, text) => x.length && traces.push({
      type: "scatter", mode: "markers", x, y, text, hovertemplate: "%{text}<extra></extra>",
      marker: { symbol, size: 10, color: colour }, showlegend: false,
    });
    marker(a.length ? [a[0]] : [], a.length ? [b[0]] : [], "circle-open", style("--ink"), ["start"]);
    marker(onto(across), onto(up), "x", style("--bad"), data.failures.map((f) => `${f.axis || ""} ${f.name} broken`));
    const isSlanted = name === "xyz";
    const along = (letter) => axis({
      title: title(isSlanted ? "" : `${letter.toUpperCase()} [mm]`), showticklabels: !isSlanted, showgrid: !isSlanted, showline: !isSlanted,
    });
    return [traces, layout({
      margin: { l: 56, r: 20, t: 14, b: 46 }, hovermode: "closest", dragmode: "pan",
      xaxis: along(name[0]),
      yaxis: { ...along(name[1]), scaleanchor: "x", scaleratio: 1 },
    })];
  }

  let view = firstView();
  function drawPath(onPaper = false) {
    const isSpatial = view === "xyz" && hasWebGL && !onPaper;
    const [traces, form] = isSpatial ? spatial() : flat(view);
    Plotly.purge("path");
    Plotly.newPlot("path", traces, form, { ...config, ...(isSpatial ? spatialTools : flatTools), scrollZoom: true });
    for (const button of element("views").children) {
      button.setAttribute("aria-pressed", String(button.dataset.view === view));
    }
  }

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
      traces.push(...curveTraces(data.length[name], from, to, { colour, width: 1.1, pixels, more, isLimit: true, top, unit: "mm/s" }));
    }
    const more = { name: "planned speed", fill: "tozeroy", fillcolor: wash("--accent", 0.12) };
    traces.push(...curveTraces(data.length.speed, from, to, { colour: "--accent", width: 2, pixels, more, unit: "mm/s" }));
    const chart = element("length");
    const old = chart.layout;
    Plotly.react(chart, traces, layout({
      margin: { l: 64, r: 20, t: 34, b: 46 }, hovermode: "x unified", dragmode: "zoom", uirevision: "length",
      legend: { orientation: "h", traceorder: "normal", x: 0, y: 1.02, yanchor: "bottom", font: { size: 13 } },
      xaxis: axis({ title: title("path length [mm]"), ...(old && Number.isFinite(from) ? { range: [from, to] } : {}) }),
      yaxis: axis({ title: title("speed [mm/s]"), range: old ? old.yaxis.range : [0, top] }),
    }), { ...config, ...flatTools });
  }

  /* Axes over time ------------------------------------------------------------------------------- */
  const turns = data.axes.some((name) => "ABC".includes(name));
  const ROWS = [["speed", "mm/s"], ...[["velocity", "s"], ["acceleration", "s²"], ["jerk", "s³"]]
    .map(([name, per]) => [name, turns ? `mm/${per}, deg/${per}` : `mm/${per}`])];
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
          const colour = `--axis-${k % 6}`;
          traces.push(...curveTraces(curve, from, to, { colour, scale: scale[k], pixels, more, unit: percent ? "%" : unit }));
          top = Math.max(top, (data.judged.includes(name) ? tops : usual)[name][k] * scale[k]);
        });
        /* A limit far outside would squeeze the curves: it is named beside the chart and drawn only when near. */
        const lines = [...new Set(limits.map((limit, k) => limit && limit * scale[k]))].filter((v) => v && v <= 2 * top);
        const reach = Math.max(top, ...lines) * 1.08 || 1;
        range = [-reach, reach];
        for (const value of lines) {
          const owners = limits.map((limit, k) => (limit && limit * scale[k] === value ? k : -1)).filter((k) => k >= 0);
          const colour = owners.length > 1 ? style("--soft") : axisColour(owners[0]);
          for (const y of [value, -value]) {
            shapes.push({ type: "line", xref: "paper", x0: 0, x1: 1, yref: id, y0: y, y1: y, line: { color: colour, width: 1, dash: "dash" } });
          }
        }
      }
      const limits = data.limits[name];
      const known = limits ? limits.map((limit, k) => (limit ? `${data.axes[k]} ${Number(limit.toPrecision(6))}` : null)).filter(Boolean) : [];
      const shownUnit = relative && limits && limits.every(Boolean) ? "% of limit" : unit;
      const rapids = name === "speed" && hidesRapids && !isNarrow ? `rapids up to ${Number(topSpeed.toPrecision(4))} mm/s run out of the chart` : "";
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

  /* Zooming in brings the finer points of the window. Redrawing answers with another event: one at a time. */
  function refines(id, draw) {
    let busy = false;
    element(id).on("plotly_relayout", (change) => {
      if (busy) return;
      const range = change["xaxis.range"] ?? (change["xaxis.range[0]"] !== undefined ? [change["xaxis.range[0]"], change["xaxis.range[1]"]] : null);
      if (!range && !change["xaxis.autorange"]) return;
      busy = true;
      if (range) draw(...range.map(Number));
      else draw();
      busy = false;
    });
  }

  function drawAll() {
    drawPath();
    drawLength();
    drawTime();
  }
  element("views").addEventListener("click", (event) => {
    if (!event.target.dataset.view) return;
    view = event.target.dataset.view;
    drawPath();
  });
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
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);

  /* Paper is light and narrow, and has no WebGL. */
  const PAPER = { path: 400, length: 320, time: 860 };
  addEventListener("beforeprint", () => {
    document.documentElement.classList.add("printing");
    drawPath(true);
    drawLength();
    drawTime();
    for (const [id, height] of Object.entries(PAPER)) Plotly.relayout(id, { width: 670, height });
  });
  addEventListener("afterprint", () => {
    document.documentElement.classList.remove("printing");
    for (const id of Object.keys(PAPER)) Plotly.relayout(id, { width: null, height: null, autosize: true });
    drawAll();
  });
})();
