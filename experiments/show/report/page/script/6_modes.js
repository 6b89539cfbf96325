// Modes of hybrid automata: the colours, dashes and patterns of modes, the shapes of programs, and the modes over time.
const MODE_DASHES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"];
const MODE_PATTERNS = ["", "/", "x", ".", "\\", "-", "+", "|"];
const PROGRAM_SYMBOLS = ["square", "hexagon", "diamond", "triangle-up", "circle", "cross", "pentagon", "star-square"];
const MARK_SYMBOLS = ["diamond", "star", "triangle-down", "bowtie", "hexagram", "cross", "triangle-left", "pentagon"];
const modeColour = (k) => pick(DATA.palette.modes[k % DATA.palette.modes.length]);
const modeDash = (k) => MODE_DASHES[k % MODE_DASHES.length];
const markStyle = (k) => ({symbol: MARK_SYMBOLS[k % MARK_SYMBOLS.length], color: pick(DATA.palette.marks[k % DATA.palette.marks.length])});

// By node: from_s, until_s and mode of its stays, in order; and the programs, those with the most robots first.
const staysOf = new Map();
const programs = [];
if (DATA.modes) {
  const s = DATA.modes.stays, count = new Map();
  DATA.modes.nodes.forEach((node) => staysOf.set(node, {from_s: [], until_s: [], mode: []}));
  s.node.forEach((n, row) => {
    const own = staysOf.get(DATA.modes.nodes[n]);
    own.from_s.push(s.from_s[row]); own.until_s.push(s.until_s[row]); own.mode.push(s.mode[row]);
  });
  DATA.modes.programs.forEach((name) => count.set(name, (count.get(name) || 0) + 1));
  programs.push(...[...count.keys()].sort((a, b) => count.get(b) - count.get(a) || (a < b ? -1 : 1)));
}
const symbolOf = (node) => PROGRAM_SYMBOLS[programs.indexOf(DATA.modes.programs[DATA.modes.nodes.indexOf(node)]) % PROGRAM_SYMBOLS.length];

// The place of a node's mode among the names at an instant; -1 before the first one and after the death of the node.
function modeAt(node, t_s) {
  const own = staysOf.get(node);
  if (!own) return -1;
  const k = firstFrom(own.from_s, t_s + 1e-9) - 1;
  return k >= 0 && (t_s < own.until_s[k] || own.until_s[k] >= DATA.length_s) ? own.mode[k] : -1;
}

// The instants at which an event with named values or a change of mode is on record.
const toldInstants = [...new Set([...DATA.marks.kinds.flatMap((kind) => kind.t_s), ...DATA.marks.polygons.map((shape) => shape.from_s),
                                  ...(DATA.modes ? DATA.modes.stays.from_s : [])])].sort((a, b) => a - b);

// What is told at an instant, in words.
function toldAt(t_s) {
  const same = (other) => Math.abs(other - t_s) < 5e-10, words = [];
  DATA.marks.kinds.forEach((kind) => kind.t_s.forEach((other, row) => same(other) && words.push(kind.text[row])));
  DATA.marks.polygons.forEach((shape) => same(shape.from_s) && words.push(shape.text));
  if (DATA.modes) {
    const s = DATA.modes.stays;
    s.from_s.forEach((other, row) => same(other)
      && words.push(`${DATA.modes.nodes[s.node[row]]} is ${DATA.modes.names[s.mode[row]]}: ${s.why[row]}`));
  }
  return words;
}

function drawModes() {
  const m = DATA.modes, s = m.stays, used = m.names.map((_, k) => s.mode.includes(k));
  const traces = [];
  m.names.forEach((name, k) => {
    if (!used[k]) return;
    const rows = s.mode.map((mode, row) => mode === k ? row : -1).filter((row) => row >= 0);
    traces.push({
      type: "bar", orientation: "h", name, base: rows.map((row) => s.from_s[row]), x: rows.map((row) => s.until_s[row] - s.from_s[row]),
      y: rows.map((row) => m.nodes[s.node[row]]), width: 0.62, customdata: rows.map((row) => s.from_s[row]),
      marker: {color: modeColour(k), line: {width: 0.6, color: css("--card")},
               pattern: {shape: MODE_PATTERNS[k % MODE_PATTERNS.length], fgcolor: css("--card"), fillmode: "overlay", size: 7, solidity: 0.22}},
      text: rows.map((row) => `${m.nodes[s.node[row]]}: ${name}, ${+s.from_s[row].toFixed(3)} to ${+s.until_s[row].toFixed(3)} s<br>${wrapped(s.why[row], 60)}`),
      textposition: "none", hovertemplate: "%{text}<extra></extra>"});
  });
  DATA.marks.kinds.forEach((kind, k) => {
    const rows = kind.node.map((node, row) => staysOf.has(node) ? row : -1).filter((row) => row >= 0);
    if (!rows.length) return;
    const {symbol, color} = markStyle(k);
    traces.push({type: "scatter", mode: "markers", name: kind.kind, x: rows.map((row) => kind.t_s[row]), y: rows.map((row) => kind.node[row]),
                 customdata: rows.map((row) => kind.t_s[row]), marker: {symbol, color, size: 9, line: {width: 1, color: css("--ink")}},
                 text: rows.map((row) => wrapped(kind.text[row], 60)), hovertemplate: "%{text}<extra></extra>"});
  });
  Plotly.react("plot-modes", traces, layout("time [s]", "", {
    barmode: "overlay", hovermode: "closest", showlegend: true, height: 120 + 26 * m.nodes.length, shapes: cursorLine(1).concat(faults(1).map(({label, ...shape}) => shape)),
    legend: {orientation: "h", y: 1.02, yanchor: "bottom", x: 0, traceorder: "normal"}, xaxis: {range: [0, DATA.length_s || 1]},
    yaxis: {type: "category", categoryorder: "array", categoryarray: m.nodes.slice().reverse(), range: [-0.6, m.nodes.length - 0.4]}}), config());
}
