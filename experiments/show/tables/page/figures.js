"use strict";
// Draws the figures (the JSON element "data") with Plotly, in the colours of experiments/show/report/palette.py.
const DATA = JSON.parse(document.getElementById("data").textContent);
const CONFIG = {responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"]};
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const pick = (light, onDark) => dark.matches ? onDark : light;
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function layout(x, y, {xaxis, yaxis}) {
  const axis = (title) => ({title: {text: title}, gridcolor: css("--line"), zerolinecolor: css("--line"),
                            linecolor: css("--line"), automargin: true});
  return {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: {l: 60, r: 44, t: 8, b: 46},
    font: {color: css("--ink"), family: "system-ui, Segoe UI, Roboto, sans-serif", size: 13},
    legend: {orientation: "h", y: 1.02, yanchor: "bottom", x: 0},
    modebar: {orientation: "v", bgcolor: "rgba(0,0,0,0)", color: css("--soft"), activecolor: css("--accent")},
    xaxis: {...axis(x), ...xaxis}, yaxis: {...axis(y), ...yaxis},
  };
}

function drawPlane(id, figure) {
  const traces = [
    {name: "actual path", mode: "lines", line: {color: css("--soft"), width: 2}, ...figure.target},
    {name: "estimate", mode: "lines", line: {color: pick("#d55e00", "#ff7a2f"), width: 1.4}, ...figure.expected},
    {name: "detections", mode: "markers", marker: {color: pick("#b97d00", "#e69f00"), symbol: "diamond", size: 8}, ...figure.seen},
  ];
  Plotly.newPlot(id, traces, layout("x [m]", "y [m]", {yaxis: {scaleanchor: "x"}}), CONFIG);
}

function drawError(id, figure) {
  const trace = {name: "error", mode: "lines", x: figure.t_s, y: figure.error_m, line: {color: css("--accent"), width: 1.4}};
  Plotly.newPlot(id, [trace], layout("time [s]", "distance from estimate to target [m]", {yaxis: {rangemode: "tozero"}}), CONFIG);
}

function drawHeights(id, figure) {
  Plotly.newPlot(id, heights(figure), heightsLayout(figure), CONFIG);
}

function drawLines(id, figure) {
  const traces = figure.lines.map((line) => ({name: line.name, mode: line.mode, x: line.x, y: line.y, line: {width: 1.4}, marker: {size: 4}}));
  const shapes = figure.changes_s.map((at) => ({type: "line", x0: at, x1: at, yref: "paper", y0: 0, y1: 1, line: {color: pick("#d55e00", "#ff7a2f"), width: 1}}));
  Plotly.newPlot(id, traces, {...layout("time [s]", figure.unit, {}), shapes}, CONFIG);
}

const DRAW = {plane: drawPlane, error: drawError, heights: drawHeights, lines: drawLines};

function drawAll() {
  DATA.forEach((figure, k) => DRAW[figure.kind](`figure-${k}`, figure));
}

drawAll();
dark.addEventListener("change", drawAll);
