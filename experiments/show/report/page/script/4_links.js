// Fates, age of information and times between transmissions by link and node; lateness in real time.
// From few to many, on light and on dark visible at both ends.
const sequential = () => [[0, pick(DATA.palette.low)], [0.5, pick(DATA.palette.middle)], [1, pick(DATA.palette.high)]];

function drawFates() {
  const links = DATA.fates;
  const several = new Set(links.map((link) => link.medium)).size > 1;
  const label = (link) => linkLabel(link, several);
  const known = Object.keys(DATA.palette.fates).filter((fate) => links.some((link) => fate in link.fates));
  if (links.length <= 40) {
    const traces = known.map((fate) => ({
      type: "bar", orientation: "h", name: fate, marker: {color: fateColour(fate)},
      y: links.map(label), x: links.map((link) => link.fates[fate] || 0),
      hovertemplate: `%{y}<br>${fate}: %{x}${meaning(fate)}<extra></extra>`,
    }));
    Plotly.react("plot-fates", traces, layout("frame copies", "", {
      barmode: "stack", bargap: 0.25, height: Math.max(240, 110 + (narrow.matches ? 32 : 22) * links.length),
      legend: {orientation: "h", y: 1.02, yanchor: "bottom", x: 0, traceorder: "normal"},
      yaxis: {autorange: "reversed", type: "category"},
    }), config());
    return;
  }
  const total = (link) => Object.values(link.fates).reduce((sum, copies) => sum + copies, 0);
  const rows = [...new Set(links.map((link) => several ? `${link.sender} · ${link.medium}` : link.sender))].sort();
  const columns = [...new Set(links.map((link) => link.receiver))].sort();
  const grid = () => rows.map(() => columns.map(() => null));
  const z = grid(), text = grid();
  for (const link of links) {
    const r = rows.indexOf(several ? `${link.sender} · ${link.medium}` : link.sender), c = columns.indexOf(link.receiver);
    z[r][c] = 100 * (1 - (link.fates[DATA.delivered] || 0) / total(link));
    text[r][c] = `${label(link)}<br>` + known.filter((f) => f in link.fates).map((f) => `${f}: ${link.fates[f]}`).join("<br>");
  }
  const most = Math.max(1, ...z.flat().filter((share) => share !== null));
  Plotly.react("plot-fates", [{type: "heatmap", x: columns, y: rows, z, hovertext: text, hovertemplate: "%{hovertext}<extra></extra>",
    texttemplate: columns.length <= 20 ? "%{z:.1f}" : "", textfont: {size: 11},
    colorscale: sequential(), zmin: 0, zmax: most, xgap: 1, ygap: 1, colorbar: {title: {text: `not ${DATA.delivered} [%]`, side: "right"}}}],
    layout("receiver", "sender", {height: Math.max(340, 110 + 22 * rows.length),
      yaxis: {autorange: "reversed", type: "category"}, xaxis: {type: "category"},
      margin: {l: narrow.matches ? 40 : 60, r: 16, t: 30, b: 46}, modebar: {...layout("", "").modebar, orientation: "h"}}), config());
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
    hovermode: "closest", yaxis: {range: [0, 101]}, height: narrow.matches ? 300 + 17 * traces.length : 380,
    xaxis: logarithmic ? {type: "log", dtick: 1, range: [Math.log10(typical / 20), Math.log10(largest * 1.1)]} : {rangemode: "tozero"},
  }), config());
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
      zmin: 0, zmax: Math.max(1, Math.log10(most)), colorscale: sequential(), showscale: k === 0,
      colorbar: {title: {text: "transmissions", side: "right"}, tickvals: powers, ticktext: powers.map((p) => String(10 ** p))},
      hovertemplate: "%{text}<extra></extra>",
    };
  });
  Plotly.react("plot-gaps", traces, layout(narrow.matches ? "from start to start [ms]" : "time from one start of transmission to the next [ms]", "", {
    hovermode: "closest", height: Math.max(240, 110 + 30 * DATA.gaps.length),
    yaxis: {tickvals: DATA.gaps.map((_, k) => k), ticktext: DATA.gaps.map(label), showgrid: false, zeroline: false,
            range: [DATA.gaps.length - 0.5, -0.5]}, margin: {l: narrow.matches ? 40 : 60, r: 16, t: 30, b: 46},
    modebar: {...layout("", "").modebar, orientation: "h"},
  }), config());
}

// The horizontal axis is log10 of ms, so that all bars are equally wide.
function drawLateness() {
  const late = DATA.lateness, bin = 0.1;
  const amount = (power) => power < -1 ? `${+(10 ** (power + 3)).toPrecision(3)} µs` : `${+(10 ** power).toPrecision(3)} ms`;
  const traces = late.kinds.map((kind, k) => ({
    type: "bar", name: kind.name, x: kind.from_log_ms.map((from) => from + bin / 2), y: kind.counts, width: bin, opacity: 0.65,
    marker: {color: pick(DATA.palette.curves[k])},
    text: kind.from_log_ms.map((from) => `${amount(from)} to ${amount(from + bin)}`), textposition: "none",
    hovertemplate: `%{text} late<br>${kind.name}: %{y}<extra></extra>`,
  }));
  const edges = late.kinds.flatMap((kind) => kind.from_log_ms), limit = Math.log10(late.limit_ms);
  const low = Math.min(...edges), high = Math.max(...edges, limit) + 2 * bin;
  const powers = [...Array(Math.floor(high) - Math.ceil(low) + 1).keys()].map((k) => Math.ceil(low) + k);
  Plotly.react("plot-lateness", traces, layout("lateness", "events", {
    barmode: "overlay", bargap: 0, height: 340, xaxis: {range: [low - bin, high], tickvals: powers, ticktext: powers.map(amount)},
    yaxis: {type: "log", dtick: 1, range: [-0.1, 0.15 + Math.log10(Math.max(...late.kinds.flatMap((kind) => kind.counts)))]},
    shapes: [{type: "line", x0: limit, x1: limit, yref: "paper", y0: 0, y1: 1, line: {color: violatedColour(), dash: "dash", width: 1.5}}],
    annotations: [{x: limit, yref: "paper", y: 1, text: "limit", showarrow: false, xanchor: "right", yanchor: "top", xshift: -4,
                   font: {color: violatedColour()}}],
  }), config());
}
