/* What the charts of all pages share: the embedded data, their looks, and curves of any number of points. */
"use strict";
const charts = (() => {
  const data = JSON.parse(document.getElementById("data").textContent, (_, value) => {
    if (value && typeof value === "object" && (value.f4 !== undefined || value.i4 !== undefined)) {
      const bytes = Uint8Array.from(atob(value.f4 ?? value.i4), (c) => c.charCodeAt(0)).buffer;
      return value.f4 !== undefined ? new Float32Array(bytes) : new Int32Array(bytes);
    }
    return value;
  });
  const element = (id) => document.getElementById(id);
  const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const axisColour = (k) => style(`--axis-${k % 9}`);
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

  return {
    data, element, style, axisColour, speedColours, config, flatTools, spatialTools, layout, axis, title, greatest,
    within, thinned, curveTraces, wash, refines,
  };
})();
