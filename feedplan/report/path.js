/* The tool path coloured by speed: in 3D where the browser can, else and on paper flat; from the chosen side. */
"use strict";
/* `path` has x, y, z, speed and line of each point and the places `marks` of the `failures`; `top` is the greatest
   speed of the colours; `onHover` gets the number of the point under the pointer. Answers with `draw` (on paper or
   not), `show` (another path and top) and `mark` (a point by its number). */
function pathChart({ path, top, failures = [], onHover }) {
  const { element, style, speedColours, config, flatTools, spatialTools, layout, axis, title } = charts;
  let topColour = top || 1;
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

  const spot = (i) => `line ${path.line[i]}<br>${path.speed[i].toPrecision(4)} ${path.unit}/s`;

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
    marker(path.marks, 8, style("--bad"), failures.map((f) => `${f.axis || ""} ${f.name} broken`));
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
    const groups = Array.from({ length: LEVELS }, () => ({ x: [], y: [], text: [], index: [], end: -1 }));
    for (let i = 0; i + 1 < a.length; i += 1) {
      const part = (path.speed[i] + path.speed[i + 1]) / 2 / topColour;
      const group = groups[Math.min(Math.floor(part * LEVELS), LEVELS - 1)];
      if (group.end !== i) {
        if (group.end >= 0) { group.x.push(null); group.y.push(null); group.text.push(""); group.index.push(-1); }
        group.x.push(a[i]); group.y.push(b[i]); group.text.push(spot(i)); group.index.push(i);
      }
      group.x.push(a[i + 1]); group.y.push(b[i + 1]); group.text.push(spot(i + 1)); group.index.push(i + 1);
      group.end = i + 1;
    }
    const traces = groups.map((group, k) => ({
      type: "scatter", mode: "lines", x: group.x, y: group.y, text: group.text, customdata: group.index,
      hovertemplate: "%{text}<extra></extra>",
      line: { color: mixed((k + 0.5) / LEVELS), width: 2, simplify: true }, showlegend: false, connectgaps: false,
    }));
    const marker = (x, y, symbol, colour, text) => x.length && traces.push({
      type: "scatter", mode: "markers", x, y, text, hovertemplate: "%{text}<extra></extra>",
      marker: { symbol, size: 10, color: colour }, showlegend: false,
    });
    marker(a.length ? [a[0]] : [], a.length ? [b[0]] : [], "circle-open", style("--ink"), ["start"]);
    marker(onto(across), onto(up), "x", style("--bad"), failures.map((f) => `${f.axis || ""} ${f.name} broken`));
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
  let isSpatial = false;
  function draw(onPaper = false) {
    isSpatial = view === "xyz" && hasWebGL && !onPaper;
    const [traces, form] = isSpatial ? spatial() : flat(view);
    Plotly.purge("path");
    Plotly.newPlot("path", [...traces, here()], form, { ...config, ...(isSpatial ? spatialTools : flatTools), scrollZoom: true });
    for (const button of element("views").children) {
      button.setAttribute("aria-pressed", String(button.dataset.view === view));
    }
    element("path").on("plotly_hover", ({ points: [point] }) => {
      const i = isSpatial ? point.pointNumber : point.customdata;
      if (onHover && Number.isInteger(i) && point.curveNumber < traces.length) onHover(i);
    });
  }

  /* The last trace: one place that another chart points to. */
  function here() {
    const marker = { symbol: isSpatial ? "circle" : "circle-open", size: isSpatial ? 6 : 12, color: style("--ink"), line: { width: 2 } };
    const place = { x: [], y: [], mode: "markers", marker, hoverinfo: "skip", showlegend: false };
    return isSpatial ? { type: "scatter3d", z: [], ...place } : { type: "scatter", ...place };
  }
  function mark(i) {
    const place = [path.x[i], path.y[i], path.z[i]];
    const last = element("path").data.length - 1;
    const onto = (direction) => direction.reduce((sum, part, k) => sum + part * place[k], 0);
    const [x, y, z] = isSpatial ? place : views[view].map(onto);
    Plotly.restyle("path", isSpatial ? { x: [[x]], y: [[y]], z: [[z]] } : { x: [[x]], y: [[y]] }, [last]);
  }

  element("views").addEventListener("click", (event) => {
    if (!event.target.dataset.view) return;
    view = event.target.dataset.view;
    draw();
  });
  return {
    draw,
    mark,
    show(other, otherTop) {
      path = other;
      topColour = otherTop || 1;
      draw();
    },
  };
}
