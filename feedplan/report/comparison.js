/* Draws the charts of a comparison: the speed of every method, linked to the tool path of the chosen one. */
"use strict";
(() => {
  const { data, element, style, config, flatTools, layout, axis, title, within, thinned, refines } = charts;
  const methods = data.methods;
  if (!methods.length) return;
  const colour = (k) => (k === 0 ? style("--accent") : style(`--axis-${(k - 1) % 6}`));
  const dash = (k) => ["solid", "dot", "dash"][Math.floor(Math.max(k - 1, 0) / 6) % 3];

  /* The way along the drawn points. */
  for (const method of methods) {
    const { x, y, z } = method;
    method.length = new Float64Array(x.length);
    for (let i = 1; i < x.length; i += 1) {
      method.length[i] = method.length[i - 1] + Math.hypot(x[i] - x[i - 1], y[i] - y[i - 1], z[i] - z[i - 1]);
    }
  }
  /* A rapid much faster than all cutting would flatten the rest: it runs out of the chart. */
  const top = Math.max(...methods.map((method) => method.cutting_speed)) || 1;
  let chosen = 0;
  let across = "length";

  /* The last point whose length or time is not beyond `value`. */
  function at(method, value) {
    const places = method[across];
    let low = 0, high = places.length - 1;
    while (low < high) {
      const middle = Math.ceil((low + high) / 2);
      if (places[middle] <= value) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  const toolPath = pathChart({ path: methods[chosen], top: methods[chosen].cutting_speed, onHover: point });

  /* A place of the chosen method as a line across the speeds. */
  function point(i) {
    const x = methods[chosen][across][i];
    const line = { type: "line", xref: "x", x0: x, x1: x, yref: "paper", y0: 0, y1: 1, line: { color: style("--ink"), width: 1 } };
    Plotly.relayout("speed", { shapes: [line] });
  }

  function drawSpeed(from = -Infinity, to = Infinity) {
    const traces = methods.map((method, k) => {
      const curve = { x: method[across], y: method.speed, line: method.line };
      const few = thinned(within(curve, from, to));
      return {
        type: "scatter", mode: "lines", name: method.method, x: few.x, y: few.y, customdata: Array.from(few.line),
        line: { color: colour(k), width: k === chosen ? 2.2 : 1.3, dash: dash(k) },
        hovertemplate: `%{y:.4~g} ${method.unit}/s, line %{customdata}`,
        visible: element("speed").data?.[k]?.visible ?? true,
      };
    });
    const unit = across === "length" ? "path length [mm]" : "time [s]";
    const old = element("speed").layout;
    Plotly.react("speed", traces, layout({
      margin: { l: 64, r: 20, t: 34, b: 46 }, hovermode: "x unified", dragmode: "zoom", uirevision: across,
      legend: { orientation: "h", traceorder: "normal", x: 0, y: 1.02, yanchor: "bottom", font: { size: 13 } },
      xaxis: axis({ title: title(unit), ...(old && Number.isFinite(from) ? { range: [from, to] } : {}) }),
      yaxis: axis({ title: title(`speed [${methods[chosen].unit}/s]`), range: [0, 1.25 * top] }),
    }), { ...config, ...flatTools });
  }

  function press(group, name, value) {
    for (const button of element(group).children) {
      button.setAttribute("aria-pressed", String(button.dataset[name] === String(value)));
    }
  }
  function choose(k) {
    chosen = k;
    press("methods", "method", k);
    element("fast").textContent = `${Number(methods[k].cutting_speed.toPrecision(4))} ${methods[k].unit}/s`;
    toolPath.show(methods[k], methods[k].cutting_speed);
    drawSpeed();
  }

  methods.forEach((method, k) => {
    const button = document.createElement("button");
    button.dataset.method = k;
    button.textContent = method.method;
    element("methods").append(button);
  });
  element("methods").addEventListener("click", (event) => {
    if (event.target.dataset.method !== undefined) choose(Number(event.target.dataset.method));
  });
  element("across").addEventListener("click", (event) => {
    if (!event.target.dataset.across) return;
    across = event.target.dataset.across;
    press("across", "across", across);
    drawSpeed();
  });
  choose(0);
  refines("speed", drawSpeed);
  element("speed").on("plotly_hover", ({ points: [{ x }] }) => toolPath.mark(at(methods[chosen], x)));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => choose(chosen));

  /* Paper is light and narrow, and has no WebGL. */
  const PAPER = { path: 400, speed: 320 };
  addEventListener("beforeprint", () => {
    document.documentElement.classList.add("printing");
    toolPath.draw(true);
    drawSpeed();
    for (const [id, height] of Object.entries(PAPER)) Plotly.relayout(id, { width: 670, height });
  });
  addEventListener("afterprint", () => {
    document.documentElement.classList.remove("printing");
    for (const id of Object.keys(PAPER)) Plotly.relayout(id, { width: null, height: null, autosize: true });
    choose(chosen);
  });
})();
