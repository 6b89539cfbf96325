"use strict";
// What all charts share: the run's numbers (the JSON element "data"), colours, layout, labels.
const DATA = JSON.parse(document.getElementById("data").textContent);
const DASHES = ["solid", "dash", "dot", "dashdot"];
const MOST_LINES = 120;
const MOST_DETECTIONS = 60;

const byId = (id) => document.getElementById(id);
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const narrow = window.matchMedia("(max-width: 640px)");
const pick = (pair) => pair[dark.matches ? 1 : 0];
const violatedColour = () => pick(DATA.palette.violated);
const switchColour = () => pick(DATA.palette.switched);
const fateColour = (fate) => pick(DATA.palette.fates[fate] || DATA.palette.curves[6]);
const stroke = (k) => ({color: pick(DATA.palette.curves[k % DATA.palette.curves.length]), width: 1.7,
                        dash: DASHES[Math.floor(k / DATA.palette.curves.length) % DASHES.length]});
const line = (node) => stroke(Math.max(0, DATA.nodes.indexOf(node)));
const named = (name, unit) => unit && unit !== "1" ? `${name} [${unit}]` : `${name} [-]`;
const seconds = (t) => `${+t.toFixed(9)} s`;
const linkLabel = (link, several) => `${link.sender} →${narrow.matches ? "<br>" : " "}${link.receiver}`
  + (several ? ` · ${link.medium}` : "");

// Plotly breaks no lines in its labels.
function wrapped(text, width = 46) {
  const lines = [""];
  for (const word of text.split(" ")) {
    if (lines[lines.length - 1].length + word.length > width) lines.push("");
    lines[lines.length - 1] += (lines[lines.length - 1] ? " " : "") + word;
  }
  return lines.join("<br>");
}
const meaning = (fate) => DATA.meanings[fate] ? `<br><i>${wrapped(DATA.meanings[fate])}</i>` : "";

const config = () => ({responsive: true, displaylogo: false, displayModeBar: !narrow.matches,
                       modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"]});

function layout(x, y, more) {
  const axis = (title) => ({title: {text: title}, gridcolor: css("--line"), zerolinecolor: css("--line"),
                            linecolor: css("--line"), automargin: true});
  const base = {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    margin: narrow.matches ? {l: 40, r: 8, t: 8, b: 40} : {l: 60, r: 44, t: 8, b: 46},
    font: {color: css("--ink"), family: "system-ui, Segoe UI, Roboto, sans-serif", size: narrow.matches ? 11 : 13},
    legend: {orientation: "h", y: 1.02, yanchor: "bottom", x: 0}, dragmode: narrow.matches ? false : "zoom",
    hoverlabel: {font: {size: 12, color: css("--ink")}, bgcolor: css("--card"), bordercolor: css("--soft"), align: "left"},
    modebar: {orientation: "v", bgcolor: "rgba(0,0,0,0)", color: css("--soft"), activecolor: css("--accent")},
    xaxis: axis(x), yaxis: axis(y),
  };
  for (const [key, value] of Object.entries(more || {})) {
    base[key] = key === "xaxis" || key === "yaxis" ? {...base[key], ...value} : value;
  }
  return base;
}

function firstFrom(sorted, value) {
  let low = 0, high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}
