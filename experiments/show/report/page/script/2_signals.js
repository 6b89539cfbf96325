// Signals and times between transmissions over time, with what marks an instant.
const MOST_NAMED_FAULTS = 12;
let signalRange = null;     // [from, until] in s, null: the whole run

function drawSignal() {
  const entry = DATA.signals[byId("signal").value];
  const traces = entry.curves.map((curve, k) => ({
    type: "scatter", mode: "lines", name: curve.label, x: curve.t_s, y: curve.values,
    line: DATA.nodes.includes(curve.label) ? line(curve.label) : stroke(k),
    hovertemplate: `${curve.label}: %{y:.5g} at %{x:.6g} s<extra></extra>`,
  }));
  const shapes = cursorLine(1);
  if (byId("marks").checked) {
    for (const [medium, instants] of Object.entries(DATA.switching.media)) {
      if (!instants.length) continue;
      traces.push({type: "scatter", mode: "markers", name: `${medium}: graph switches`, x: instants,
                   y: instants.map(() => 0.02), yaxis: "y2", marker: {color: switchColour(), size: 7},
                   hovertemplate: `${medium} switches at %{x:.9g} s<extra></extra>`});
      if (instants.length <= MOST_LINES) {
        instants.forEach((t) => shapes.push({type: "line", x0: t, x1: t, y0: 0, y1: 1, yref: "paper", layer: "below",
                                             line: {color: switchColour(), width: 0.7, dash: "dot"}}));
      }
    }
    traces.push(...marks());
    DATA.violated.forEach((v) => shapes.push({type: "rect", x0: v.from_s, x1: v.until_s, y0: 0, y1: 1, yref: "paper",
                                              layer: "below", line: {width: 0}, fillcolor: violatedColour(), opacity: 0.14}));
    shapes.push(...faults(1));
  }
  byId("signal-note").textContent = entry.shown < entry.samples
    ? `${entry.shown} of ${entry.samples} samples drawn: the extremes of each stretch` : "";
  byId("signal-whole").hidden = signalRange === null;
  const yaxis = signalRange ? {range: extent(entry, signalRange)} : {autorange: true};
  Plotly.react("plot-signal", traces, layout("time [s]", named(entry.name, entry.unit), {
    shapes, hovermode: "closest", showlegend: true, xaxis: {range: signalRange || [0, DATA.length_s || 1]}, yaxis,
    yaxis2: {overlaying: "y", range: [0, 1], visible: false, fixedrange: true},
  }), config());
}

// Lowest and highest of what a signal's curves show between two instants, with some room.
function extent(entry, [from, until]) {
  let low = Infinity, high = -Infinity;
  for (const curve of entry.curves) {
    const end = Math.min(curve.t_s.length, firstFrom(curve.t_s, until) + 1);
    for (let k = Math.max(0, firstFrom(curve.t_s, from) - 1); k < end; k++) {
      if (curve.values[k] === null) continue;
      low = Math.min(low, curve.values[k]);
      high = Math.max(high, curve.values[k]);
    }
  }
  if (low > high) return [-1, 1];
  const room = 0.08 * (high - low) || 0.05 * Math.abs(high) || 1;
  return [low - room, high + room];
}

// What nodes did that marks an instant, as triangles at the upper edge (axis y2 runs from 0 to 1).
function marks() {
  return DATA.switching.marks.map(({label, events}, k) => ({
    type: "scatter", mode: "markers", name: label, x: events.map((e) => e.t_s), y: events.map(() => 0.985 - 0.03 * k), yaxis: "y2",
    marker: {symbol: "triangle-down", size: 8, color: label === "guarantee violated" ? violatedColour() : css("--soft")},
    text: events.map((e) => wrapped(e.text, 60)), hovertemplate: "%{text} at %{x:.9g} s<extra></extra>"}));
}

// The intervals of faults, shaded; a few have their names at the upper edge. `unit` is the number of x units in 1 s.
function faults(unit) {
  const named = DATA.faulty.length <= MOST_NAMED_FAULTS;
  return DATA.faulty.map((f, k) => ({
    type: "rect", x0: f.from_s * unit, x1: f.until_s * unit, y0: 0, y1: 1, yref: "paper", layer: "below", line: {width: 0},
    fillcolor: css("--soft"), opacity: 0.16,
    ...(named ? {label: {text: "<br>".repeat(1 + k % 4) + f.text, textposition: "top left", yanchor: "top", padding: 3,
                         font: {size: 10, color: css("--ink")}}} : {})}));
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
    shapes: cursorLine(1).concat(faults(1)), yaxis2: {overlaying: "y", range: [0, 1], visible: false, fixedrange: true},
  }), config());
}
