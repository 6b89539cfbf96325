// Who spoke when: one bar per frame.
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
      + `<br>${DATA.delivered} ${s.heard[k]} of ${s.copies[k]}` + (name === DATA.delivered ? "" : `, ${name}`) + meaning(name);
    const kind = airtime === null ? name + " (not on the air)" : name;
    const row = rows[kind] = rows[kind] || {fate: name, onAir: airtime !== null, base: [], x: [], y: [], text: []};
    const drawn = airtime === null ? null : Math.max(airtime, width / 500);     // a frame without airtime is seen too
    row.base.push(s.start_ms[k]); row.x.push(drawn); row.y.push(label); row.text.push(what);
    shown += 1;
  }
  const traces = Object.keys(rows).sort().map((kind) => {
    const row = rows[kind];
    const common = {name: kind, y: row.y, text: row.text, hovertemplate: "%{text}<extra></extra>"};
    const color = fateColour(row.fate);
    return row.onAir
      ? {...common, type: "bar", orientation: "h", base: row.base, x: row.x, textposition: "none", marker: {color}, width: 0.7}
      : {...common, type: "scatter", mode: "markers", x: row.base, marker: {color, symbol: "x", size: 8}};
  });
  const spoken = several ? new Set(s.sender.codes.map((code, k) => code * s.medium.names.length + s.medium.codes[k])) : null;
  const labels = s.sender.names.flatMap((sender, j) => several
    ? s.medium.names.filter((_, m) => spoken.has(j * s.medium.names.length + m)).map((medium) => `${sender} · ${medium}`)
    : [sender]);
  const shapes = cursorLine(1e3).concat(faults(1e3)).concat(Object.values(DATA.switching.media).flat().map((t) => t * 1e3)
    .filter((t) => t >= from && t < from + width)
    .map((t) => ({type: "line", x0: t, x1: t, y0: 0, y1: 1, yref: "paper", line: {color: switchColour(), width: 1.5, dash: "dot"}})));
  byId("slot-note").textContent = `${shown} ${shown === 1 ? "frame" : "frames"} in this window`
    + (s.rows < s.total ? `; of ${s.total} frames the page holds those up to ${s.until_s.toFixed(3)} s`
      + (s.rows > firstFrom(s.start_ms, s.until_s * 1e3 + 1e-6) ? ` and ${s.around_s} s before and after what broke` : "") : "");
  Plotly.react("plot-slots", traces, layout("time [ms]", "", {
    barmode: "overlay", shapes, hovermode: "closest", showlegend: true, height: Math.max(340, 120 + 26 * labels.length),
    xaxis: {range: [from, from + width], exponentformat: "none"},
    yaxis: {categoryorder: "array", categoryarray: labels.slice().reverse(), type: "category",
            range: [-0.6, labels.length - 0.4]},
  }), config());
}
