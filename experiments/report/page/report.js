"use strict";
// Draws the run's numbers (the JSON element "data") with Plotly. Colours: Okabe and Ito (2008), readable by the colour-blind.
const DATA = JSON.parse(document.getElementById("data").textContent);
const HUES = ["#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9", "#8c8c8c"];
const DASHES = ["solid", "dash", "dot", "dashdot"];
const FATE_COLOURS = {
  "delivered": "#009e73", "delivered corrupt": "#f0e442", "collided": "#d55e00", "deaf": "#cc79a7", "too weak": "#8c8c8c",
  "out of view": "#9aa5b1", "occluded": "#4d4d4d", "bus off": "#3b3b98",
  "lost": "#e69f00", "corrupted": "#b8860b", "queue full": "#0072b2", "sender busy": "#56b4e9", "channel busy": "#7b68c8",
  "malformed": "#a05a2c", "unfinished": "#b9c2cb", "receiver gone": "#5c6672",
};
const SWITCH_COLOUR = "#d03ac0";
const VIOLATED_COLOUR = "#d55e00";
const CONFIG = {responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"]};
const MOST_LINES = 120;
const MOST_DETECTIONS = 60;

const byId = (id) => document.getElementById(id);
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const stroke = (k) => {
  const hue = HUES[k % HUES.length];
  return {color: dark.matches && hue === "#0072b2" ? "#8094ff" : hue, width: 1.7,
          dash: DASHES[Math.floor(k / HUES.length) % DASHES.length]};
};
const line = (node) => stroke(Math.max(0, DATA.nodes.indexOf(node)));
const named = (name, unit) => unit && unit !== "1" ? `${name} [${unit}]` : `${name} [-]`;

function layout(x, y, more) {
  const axis = (title) => ({title: {text: title}, gridcolor: css("--line"), zerolinecolor: css("--line"),
                            linecolor: css("--line"), automargin: true});
  const base = {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", margin: {l: 60, r: 44, t: 8, b: 46},
    font: {color: css("--ink"), family: "system-ui, Segoe UI, Roboto, sans-serif", size: 13},
    legend: {orientation: "h", y: 1.02, yanchor: "bottom", x: 0}, hoverlabel: {font: {size: 12}},
    modebar: {orientation: "v", bgcolor: "rgba(0,0,0,0)", color: css("--soft"), activecolor: css("--accent")},
    xaxis: axis(x), yaxis: axis(y),
  };
  for (const [key, value] of Object.entries(more || {})) {
    base[key] = key === "xaxis" || key === "yaxis" ? {...base[key], ...value} : value;
  }
  return base;
}

function drawSignal() {
  const entry = DATA.signals[byId("signal").value];
  const traces = entry.curves.map((curve, k) => ({
    type: "scatter", mode: "lines", name: curve.label, x: curve.t_s, y: curve.values,
    line: DATA.nodes.includes(curve.label) ? line(curve.label) : stroke(k),
    hovertemplate: `${curve.label}: %{y:.5g} at %{x:.6g} s<extra></extra>`,
  }));
  const shapes = [];
  if (byId("marks").checked) {
    for (const [medium, instants] of Object.entries(DATA.switching.media)) {
      if (!instants.length) continue;
      traces.push({type: "scatter", mode: "markers", name: `${medium}: graph switches`, x: instants,
                   y: instants.map(() => 0.02), yaxis: "y2", marker: {color: SWITCH_COLOUR, size: 7},
                   hovertemplate: `${medium} switches at %{x:.9g} s<extra></extra>`});
      if (instants.length <= MOST_LINES) {
        instants.forEach((t) => shapes.push({type: "line", x0: t, x1: t, y0: 0, y1: 1, yref: "paper", layer: "below",
                                             line: {color: SWITCH_COLOUR, width: 0.7, dash: "dot"}}));
      }
    }
    traces.push(...marks());
    DATA.violated.forEach((v) => shapes.push({type: "rect", x0: v.from_s, x1: v.until_s, y0: 0, y1: 1, yref: "paper",
                                              layer: "below", line: {width: 0}, fillcolor: VIOLATED_COLOUR, opacity: 0.12}));
  }
  byId("signal-note").textContent = entry.shown < entry.samples
    ? `${entry.shown} of ${entry.samples} samples drawn: the extremes of each stretch` : "";
  Plotly.react("plot-signal", traces, layout("time [s]", named(entry.name, entry.unit), {
    shapes, hovermode: "closest", showlegend: true, xaxis: {range: [0, DATA.length_s || 1]}, yaxis2: {overlaying: "y", range: [0, 1], visible: false, fixedrange: true},
  }), CONFIG);
}

// What nodes did that marks an instant, as triangles at the upper edge (axis y2 runs from 0 to 1).
function marks() {
  return DATA.switching.marks.map(({label, events}, k) => ({
    type: "scatter", mode: "markers", name: label, x: events.map((e) => e.t_s), y: events.map(() => 0.985 - 0.03 * k), yaxis: "y2",
    marker: {symbol: "triangle-down", size: 8, color: label === "guarantee violated" ? VIOLATED_COLOUR : css("--soft")}, text: events.map((e) => e.text),
    hovertemplate: "%{text} at %{x:.9g} s<extra></extra>"}));
}

function drawIntervals() {
  const gap = DATA.gaps[byId("interval").value];
  const traces = [{type: "scatter", mode: "markers", name: `${gap.sender} on ${gap.medium}`, x: gap.t_s, y: gap.gaps_ms,
                   marker: {size: 4, color: line(gap.sender).color},
                   hovertemplate: "%{y:.6g} ms since the one before, at %{x:.9g} s<extra></extra>"}, ...marks()];
  byId("interval-note").textContent = gap.t_s.length < gap.transmissions - 1
    ? `${gap.t_s.length} of ${gap.transmissions - 1} intervals drawn: the extremes of each stretch` : "";
  Plotly.react("plot-intervals", traces, layout("time of the transmission [s]", "since the one before [ms]", {
    hovermode: "closest", showlegend: true, height: 340, xaxis: {range: [0, DATA.length_s || 1]}, yaxis: {rangemode: "tozero"},
    yaxis2: {overlaying: "y", range: [0, 1], visible: false, fixedrange: true},
  }), CONFIG);
}

function drawSlots() {
  const s = DATA.spoken;
  const from = Math.max(0, Number(byId("slot-from").value) || 0);
  const width = Number(byId("slot-width").value);
  const several = s.medium.names.length > 1;
  const rows = {};
  let shown = 0;
  for (let k = firstFrom(s.start_ms, from - 1000); k < s.rows && s.start_ms[k] < from + width; k++) {
    const airtime = s.airtime_ms[k];
    if (s.start_ms[k] + (airtime || 0) < from) continue;
    const name = s.outcome.names[s.outcome.codes[k]];
    const sender = s.sender.names[s.sender.codes[k]];
    const medium = s.medium.names[s.medium.codes[k]];
    const label = several ? `${sender} · ${medium}` : sender;
    const what = `${sender} on ${medium}, frame ${s.number[k]}, ${s.bytes[k]} bytes<br>from ${s.start_ms[k].toFixed(6)} ms`
      + (airtime === null ? ", not on the air" : ` for ${airtime.toFixed(6)} ms`)
      + `<br>delivered ${s.heard[k]} of ${s.copies[k]}` + (name === "delivered" ? "" : `, ${name}`);
    const kind = airtime === null ? name + " (not on the air)" : name;
    const row = rows[kind] = rows[kind] || {fate: name, onAir: airtime !== null, base: [], x: [], y: [], text: []};
    const drawn = airtime === null ? null : Math.max(airtime, width / 500);     // a frame without airtime is seen too
    row.base.push(s.start_ms[k]); row.x.push(drawn); row.y.push(label); row.text.push(what);
    shown += 1;
  }
  const traces = Object.keys(rows).sort().map((kind) => {
    const row = rows[kind];
    const common = {name: kind, y: row.y, text: row.text, hovertemplate: "%{text}<extra></extra>"};
    const color = FATE_COLOURS[row.fate] || "#8c8c8c";
    return row.onAir
      ? {...common, type: "bar", orientation: "h", base: row.base, x: row.x, textposition: "none", marker: {color}, width: 0.7}
      : {...common, type: "scatter", mode: "markers", x: row.base, marker: {color, symbol: "x", size: 8}};
  });
  const spoken = several ? new Set(s.sender.codes.map((code, k) => code * s.medium.names.length + s.medium.codes[k])) : null;
  const labels = s.sender.names.flatMap((sender, j) => several
    ? s.medium.names.filter((_, m) => spoken.has(j * s.medium.names.length + m)).map((medium) => `${sender} · ${medium}`)
    : [sender]);
  const shapes = Object.values(DATA.switching.media).flat().map((t) => t * 1e3)
    .filter((t) => t >= from && t < from + width)
    .map((t) => ({type: "line", x0: t, x1: t, y0: 0, y1: 1, yref: "paper", line: {color: SWITCH_COLOUR, width: 1.5, dash: "dot"}}));
  byId("slot-note").textContent = `${shown} frames in this window`
    + (s.rows < s.total ? `; the page holds the first ${s.rows} of ${s.total} frames, up to ${s.until_s.toFixed(3)} s` : "");
  Plotly.react("plot-slots", traces, layout("time [ms]", "", {
    barmode: "overlay", shapes, hovermode: "closest", showlegend: true, height: Math.max(340, 120 + 26 * labels.length),
    xaxis: {range: [from, from + width]},
    yaxis: {categoryorder: "array", categoryarray: labels.slice().reverse(), type: "category",
            range: [-0.6, labels.length - 0.4]},
  }), CONFIG);
}

function firstFrom(sorted, value) {
  let low = 0, high = sorted.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (sorted[middle] < value) low = middle + 1; else high = middle;
  }
  return low;
}

function drawFates() {
  const links = DATA.fates;
  const several = new Set(links.map((link) => link.medium)).size > 1;
  const label = (link) => `${link.sender} → ${link.receiver}` + (several ? ` · ${link.medium}` : "");
  const known = Object.keys(FATE_COLOURS).filter((fate) => links.some((link) => fate in link.fates));
  if (links.length <= 40) {
    const traces = known.map((fate) => ({
      type: "bar", orientation: "h", name: fate, marker: {color: FATE_COLOURS[fate]},
      y: links.map(label), x: links.map((link) => link.fates[fate] || 0),
      hovertemplate: `%{y}<br>${fate}: %{x}<extra></extra>`,
    }));
    Plotly.react("plot-fates", traces, layout("frame copies", "", {
      barmode: "stack", bargap: 0.25, height: Math.max(240, 110 + 22 * links.length),
      legend: {orientation: "h", y: 1.02, yanchor: "bottom", x: 0, traceorder: "normal"},
      yaxis: {autorange: "reversed", type: "category"},
    }), CONFIG);
    return;
  }
  const total = (link) => Object.values(link.fates).reduce((sum, copies) => sum + copies, 0);
  const rows = [...new Set(links.map((link) => several ? `${link.sender} · ${link.medium}` : link.sender))].sort();
  const columns = [...new Set(links.map((link) => link.receiver))].sort();
  const grid = () => rows.map(() => columns.map(() => null));
  const z = grid(), text = grid();
  for (const link of links) {
    const r = rows.indexOf(several ? `${link.sender} · ${link.medium}` : link.sender), c = columns.indexOf(link.receiver);
    z[r][c] = 100 * (1 - (link.fates.delivered || 0) / total(link));
    text[r][c] = `${label(link)}<br>` + known.filter((f) => f in link.fates).map((f) => `${f}: ${link.fates[f]}`).join("<br>");
  }
  const most = Math.max(1, ...z.flat().filter((share) => share !== null));
  Plotly.react("plot-fates", [{type: "heatmap", x: columns, y: rows, z, hovertext: text, hovertemplate: "%{hovertext}<extra></extra>",
    texttemplate: columns.length <= 20 ? "%{z:.1f}" : "", textfont: {size: 11},
    colorscale: "Cividis", zmin: 0, zmax: most, xgap: 1, ygap: 1, colorbar: {title: {text: "not delivered [%]", side: "right"}}}],
    layout("receiver", "sender", {height: Math.max(340, 110 + 22 * rows.length),
      yaxis: {autorange: "reversed", type: "category"}, xaxis: {type: "category"},
      margin: {l: 60, r: 16, t: 30, b: 46}, modebar: {...layout("", "").modebar, orientation: "h"}}), CONFIG);
}

function drawAges() {
  const links = DATA.ages.links.filter((link) => link.ages_ms);
  const several = new Set(links.map((link) => link.medium)).size > 1;
  const traces = links.map((link, k) => ({
    type: "scatter", mode: "lines", name: `${link.sender} → ${link.receiver}` + (several ? ` · ${link.medium}` : ""),
    x: link.ages_ms, y: DATA.ages.shares.map((share) => 100 * share),
    line: stroke(k),
    hovertemplate: `${link.sender} → ${link.receiver}: %{y:.1f} % of the time below %{x:.5g} ms<extra></extra>`,
  }));
  const largest = Math.max(...links.map((link) => link.ages_ms[link.ages_ms.length - 1]));
  const typical = Math.max(...links.map((link) => link.ages_ms[45]));
  const logarithmic = typical > 0 && largest / typical > 20;
  Plotly.react("plot-ages", traces, layout("age [ms]", "share of time below [%]", {
    hovermode: "closest", yaxis: {range: [0, 101]}, height: 380,
    xaxis: logarithmic ? {type: "log", dtick: 1, range: [Math.log10(typical / 20), Math.log10(largest * 1.1)]} : {rangemode: "tozero"},
  }), CONFIG);
}

function drawGaps() {
  const media = [...new Set(DATA.gaps.map((gap) => gap.medium))];
  const label = (gap) => media.length > 1 ? `${gap.sender} · ${gap.medium}` : gap.sender;
  const most = Math.max(...DATA.gaps.flatMap((gap) => gap.counts));
  const powers = [...Array(Math.floor(Math.log10(most)) + 1).keys()];
  const traces = media.map((medium, k) => {
    const own = DATA.gaps.filter((gap) => gap.medium === medium);
    return {
      type: "heatmap", x: own[0].edges_ms, y: own.map((gap) => DATA.gaps.indexOf(gap)), ygap: 4,
      z: own.map((gap) => gap.counts.map((count) => count ? Math.log10(count) : null)),
      text: own.map((gap) => gap.counts.map((count, i) =>
        `${label(gap)}: ${count} between ${gap.edges_ms[i].toPrecision(6)} and ${gap.edges_ms[i + 1].toPrecision(6)} ms`)),
      zmin: 0, zmax: Math.max(1, Math.log10(most)), colorscale: "Cividis", showscale: k === 0,
      colorbar: {title: {text: "transmissions", side: "right"}, tickvals: powers, ticktext: powers.map((p) => String(10 ** p))},
      hovertemplate: "%{text}<extra></extra>",
    };
  });
  Plotly.react("plot-gaps", traces, layout("time from one start of transmission to the next [ms]", "", {
    hovermode: "closest", height: Math.max(240, 110 + 30 * DATA.gaps.length),
    yaxis: {tickvals: DATA.gaps.map((_, k) => k), ticktext: DATA.gaps.map(label), showgrid: false, zeroline: false,
            range: [DATA.gaps.length - 0.5, -0.5]}, margin: {l: 60, r: 16, t: 30, b: 46},
    modebar: {...layout("", "").modebar, orientation: "h"},
  }), CONFIG);
}

// The plane at one instant: where everybody is, the way that led there, fields of view and the looks until then.
function drawPlane() {
  const p = DATA.plane, k = Number(byId("plane-at").value), now = p.instants_s[k];
  const frame_s = p.instants_s.length > 1 ? p.instants_s[1] - p.instants_s[0] : 0, recent_s = Math.max(0.3, 1.5 * frame_s);
  const turned = (body) => body.heading && body.heading[k] !== null ? body.heading[k] : 0;
  const looks = p.looks.filter((look) => look.t_s <= now && look.x !== null);
  const looking = new Set(looks.filter((look) => look.t_s > now - recent_s).map((look) => look.observer));
  const traces = [];
  p.views.forEach((view) => {
    const body = p.bodies.find((one) => one.label === view.carrier);
    if (!body || body.x[k] === null) return;
    const half = view.half_angle_deg * Math.PI / 180, whole = view.half_angle_deg >= 180;
    const angles = [...Array(61).keys()].map((j) => turned(body) - half + 2 * half * j / 60);
    const xs = angles.map((a) => body.x[k] + view.range_m * Math.cos(a)), ys = angles.map((a) => body.y[k] + view.range_m * Math.sin(a));
    if (!whole) { xs.unshift(body.x[k]); ys.unshift(body.y[k]); }
    const active = looking.has(view.observer);
    traces.push({type: "scatter", mode: "lines", fill: "toself", x: xs, y: ys, hoverinfo: "skip", opacity: active ? 0.6 : 0.25, showlegend: false,
                 line: {color: line(body.label).color, width: active ? 2.5 : 0.8}});
  });
  const marks = (name, chosen, marker) => {
    if (chosen.length) traces.push({type: "scatter", mode: "markers", name, x: chosen.map((look) => look.x), y: chosen.map((look) => look.y), marker,
      text: chosen.map((look) => `${look.observer} looks at ${look.body}, ${look.t_s.toFixed(3)} s: ${look.fate}`), hovertemplate: "%{text}<extra></extra>"});
  };
  const fresh = looks.filter((look) => look.t_s > now - recent_s);
  marks("looks", looks.filter((look) => look.seen && look.t_s <= now - recent_s), {size: 6, opacity: 0.35, color: css("--soft"), symbol: "circle-open"});
  const way = (body, style) => traces.push({
    type: "scatter", mode: "lines", name: body.label, legendgroup: body.label, x: body.x.slice(0, k + 1), y: body.y.slice(0, k + 1),
    line: style, hoverinfo: "skip"});
  p.bodies.forEach((body) => way(body, line(body.label)));
  p.believed.forEach((body, j) => {
    const colour = line(body.body).color, others = p.believed.slice(0, j).filter((one) => one.body === body.body).length;
    way(body, {color: colour, width: 1, dash: ["dot", "dash", "dashdot"][others % 3]});
    traces.push({type: "scatter", mode: "markers", legendgroup: body.label, showlegend: false, x: [body.x[k]], y: [body.y[k]],
                 marker: {color: colour, size: 11, symbol: "star-open", line: {width: 2}}, hovertemplate: `${body.label}: %{x:.4g} m, %{y:.4g} m<extra></extra>`});
  });
  p.detections.forEach((points) => {
    const until = firstFrom(points.t_s, now + 1e-9), from = Math.max(0, until - MOST_DETECTIONS);
    traces.push({type: "scatter", mode: "markers", name: `${points.label}: detections`, x: points.x.slice(from, until), y: points.y.slice(from, until),
                 text: points.t_s.slice(from, until).map((t) => `${points.label} was told of this until ${t.toFixed(3)} s`), hovertemplate: "%{text}<extra></extra>",
                 marker: {color: line(points.body).color, size: 6, symbol: "diamond", opacity: 0.75, line: {width: 0.5, color: css("--ink")}}});
  });
  marks("looks just now", fresh.filter((look) => look.seen), {size: 15, color: css("--ink"), symbol: "circle-open", line: {width: 2}});
  marks("looks lost on the way", looks.filter((look) => !look.seen && look.fate !== "out of view" && look.fate !== "occluded"),
    {size: 5, color: VIOLATED_COLOUR, symbol: "x-thin", line: {width: 1, color: VIOLATED_COLOUR}});
  marks("not in view just now", fresh.filter((look) => look.fate === "out of view" || look.fate === "occluded"), {size: 11, color: VIOLATED_COLOUR, symbol: "x-open"});
  p.bodies.forEach((body) => traces.push({
    type: "scatter", mode: "markers", legendgroup: body.label, showlegend: false, x: [body.x[k]], y: [body.y[k]],
    marker: {color: line(body.label).color, size: 14, symbol: body.heading ? "arrow" : "circle",
             angle: 90 - turned(body) * 180 / Math.PI, line: {width: 1, color: css("--ink")}},
    hovertemplate: `${body.label}: %{x:.4g} m, %{y:.4g} m<extra></extra>`}));
  const broken = DATA.violated.some((stretch) => stretch.from_s <= now && now < stretch.until_s);
  byId("plane-time").textContent = `${now.toFixed(2)} s${broken ? ", a guarantee is violated" : ""}`;
  byId("plane-time").style.color = broken ? VIOLATED_COLOUR : "";
  byId("plane-note").textContent = p.looks.length < p.looks_total ? `${p.looks.length} of ${p.looks_total} looks drawn: the first ones in view` : "";
  const shapes = p.obstacles.map((o) => ({type: "circle", x0: o.x - o.radius_m, x1: o.x + o.radius_m, y0: o.y - o.radius_m,
                                          y1: o.y + o.radius_m, fillcolor: css("--soft"), opacity: 0.5, line: {width: 0}}));
  const [xs, ys] = planeRanges();
  Plotly.react("plot-plane", traces, layout("x [m]", "y [m]", {
    shapes, hovermode: "closest", showlegend: true, height: 640, legend: {orientation: "v", x: 1.01, y: 0.8, yanchor: "top"}, xaxis: {range: xs, constrain: "domain"},
    yaxis: {range: ys, scaleanchor: "x", constrain: "domain"}, uirevision: "plane"}), CONFIG);
}

// The same for all instants, so that nothing jumps; what is believed of a lost target may run out of the picture.
function planeRanges() {
  const p = DATA.plane, all = p.bodies, reach = Math.max(0, ...p.views.map((view) => view.range_m));
  return ["path_x", "path_y"].map((axis) => {
    const values = all.flatMap((body) => body[axis]).filter((value) => value !== null);
    const low = Math.min(...values), high = Math.max(...values), room = reach + 0.06 * (high - low) + 0.05;
    return [low - room, high + room];
  });
}

let playing = null;
function playPlane() {
  const slider = byId("plane-at"), last = Number(slider.max), instants = DATA.plane.instants_s;
  const stop = () => { cancelAnimationFrame(playing); playing = null; byId("plane-play").textContent = "▶ play"; };
  if (playing !== null) { stop(); return; }
  if (Number(slider.value) >= last) { slider.value = 0; drawPlane(); }
  const from_s = instants[Number(slider.value)], started = performance.now();
  byId("plane-play").textContent = "❚❚ pause";
  const step = (wall) => {
    const now_s = from_s + Number(byId("plane-speed").value) * (wall - started) / 1000;
    const k = Math.min(last, Math.max(0, firstFrom(instants, now_s)));
    if (k !== Number(slider.value)) { slider.value = k; drawPlane(); }
    if (k >= last) stop(); else playing = requestAnimationFrame(step);
  };
  playing = requestAnimationFrame(step);
}

const drawers = [];
function drawing(id, draw) {
  if (byId(id)) drawers.push(draw);
}

if (byId("signal")) {
  DATA.signals.forEach((entry, k) => byId("signal").add(new Option(named(entry.name, entry.unit), k)));
  byId("signal").onchange = byId("marks").onchange = drawSignal;
}
if (byId("interval")) {
  DATA.gaps.forEach((gap, k) => byId("interval").add(new Option(`${gap.sender} on ${gap.medium}`, k)));
  byId("interval").onchange = drawIntervals;
}
if (byId("slot-from")) {
  const step = (sign) => () => {
    byId("slot-from").value = Math.max(0, Number(byId("slot-from").value) + sign * Number(byId("slot-width").value));
    drawSlots();
  };
  byId("slot-from").onchange = byId("slot-width").onchange = drawSlots;
  byId("slot-back").onclick = step(-1);
  byId("slot-on").onclick = step(1);
  const instants = [...new Set(Object.values(DATA.switching.media).flat())].filter((t) => t <= DATA.spoken.until_s).slice(0, 500);
  byId("slot-switch").add(new Option(instants.length ? "choose" : "none", ""));
  instants.forEach((t) => byId("slot-switch").add(new Option(`${+t.toFixed(9)} s`, t)));
  byId("slot-switch").onchange = () => {
    if (byId("slot-switch").value === "") return;
    byId("slot-from").value = Math.max(0, byId("slot-switch").value * 1e3 - Number(byId("slot-width").value) / 2);
    drawSlots();
  };
}
if (byId("plane-at")) {
  byId("plane-at").oninput = drawPlane;
  byId("plane-play").onclick = playPlane;
}
drawing("plot-signal", drawSignal);
drawing("plot-plane", drawPlane);
drawing("plot-slots", drawSlots);
drawing("plot-fates", drawFates);
drawing("plot-ages", drawAges);
drawing("plot-gaps", drawGaps);
drawing("plot-intervals", drawIntervals);
drawers.forEach((draw) => draw());
dark.addEventListener("change", () => drawers.forEach((draw) => draw()));
