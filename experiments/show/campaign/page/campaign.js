"use strict";
// Draws the plots (the JSON element "data") with Plotly, in the colours of experiments/show/report/palette.py.
const DATA = JSON.parse(document.getElementById("data").textContent);
const CONFIG = {responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"]};
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const hue = (k) => DATA.curves[k % DATA.curves.length][dark.matches ? 1 : 0];

function layout(plot) {
  const axis = (title) => ({title: {text: title}, gridcolor: css("--line"), zerolinecolor: css("--line"),
                            linecolor: css("--line"), automargin: true});
  const across = plot.kind === "histogram";
  const bounds = [plot.min, plot.max].filter((bound) => bound !== null && bound !== undefined);
  return {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: {l: 60, r: 44, t: 8, b: 46},
    font: {color: css("--ink"), family: "system-ui, Segoe UI, Roboto, sans-serif", size: 13},
    legend: {orientation: "h", y: 1.02, yanchor: "bottom", x: 0}, barmode: "overlay",
    modebar: {orientation: "v", bgcolor: "rgba(0,0,0,0)", color: css("--soft"), activecolor: css("--accent")},
    xaxis: axis(plot.x), yaxis: axis(plot.y),
    shapes: bounds.map((bound) => ({type: "line", line: {color: css("--bad"), width: 1.5, dash: "dash"},
      ...(across ? {x0: bound, x1: bound, yref: "paper", y0: 0, y1: 1} : {y0: bound, y1: bound, xref: "paper", x0: 0, x1: 1})})),
  };
}

const DRAW = {
  curves: (plot) => plot.curves.map((curve, k) => ({
    name: curve.label, showlegend: plot.curves.length > 1, x: curve.x, y: curve.y, mode: "lines+markers",
    line: {color: hue(k), width: 1.6}, error_y: {type: "data", array: curve.above, arrayminus: curve.below, thickness: 1.2}})),
  points: (plot) => plot.groups.map((group, k) => ({
    name: group.label, x: group.x, y: group.y, text: group.text, mode: "markers", type: "scatter",
    marker: {color: k ? css("--bad") : hue(0), size: 6, symbol: k ? "x" : "circle"}})),
  histogram: (plot) => [{type: "histogram", x: plot.values, marker: {color: hue(0)}}],
  runs: (plot) => plot.curves.map((curve, k) => ({
    name: curve.label, x: curve.t_s, y: curve.values, mode: "lines",
    line: {color: hue(curve.hue), width: 1.4, dash: curve.run ? "dot" : "solid"}})),
  two: (plot) => plot.groups.map((group, k) => ({
    type: "histogram", name: group.label, x: group.values, opacity: 0.6, marker: {color: hue(k)}})),
};

function drawAll() {
  DATA.plots.forEach((plot, k) => Plotly.react(`plot-${k}`, DRAW[plot.kind](plot), layout(plot), CONFIG));
}

drawAll();
dark.addEventListener("change", drawAll);
