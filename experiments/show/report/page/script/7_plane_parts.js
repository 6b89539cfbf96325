// Parts of the plane that not every run has: the ground, polygons and points of events, and robots with modes.

// What keeps words readable on obstacles and paths.
const halo = () => ["1px 1px", "-1px 1px", "1px -1px", "-1px -1px", "0 0"].map((by) => `${by} 2px ${css("--card")}`).join(", ");

// Several polygons as one trace, with gaps between them; all counterclockwise, so that none is a hole in another.
function together(polygons) {
  const x = [], y = [];
  polygons.forEach((shape) => {
    const turn = shape.x.reduce((sum, at, j) => sum + at * shape.y[(j + 1) % shape.y.length] - shape.x[(j + 1) % shape.x.length] * shape.y[j], 0);
    const along = (values) => [...(turn < 0 ? [...values].reverse() : values), turn < 0 ? values[values.length - 1] : values[0], null];
    x.push(...along(shape.x));
    y.push(...along(shape.y));
  });
  return {x, y};
}

// A name of a trace by which Plotly keeps what a reader hid in the legend; Plotly takes letters, digits and _ only.
const uidOf = (text) => text.replace(/\W/g, (sign) => `_${sign.charCodeAt(0)}_`);

const faded = (colour, share) => {
  const [red, green, blue] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  return `rgba(${red},${green},${blue},${share})`;
};

// The declared area and what stands (solid) or lies (hatched) in it.
function groundTraces() {
  const ground = DATA.plane.ground;
  if (!ground) return [];
  const [[west, east], [south, north]] = ground.area, solid = [css("--ink"), css("--soft")];
  const lying = [violatedColour(), switchColour(), pick(DATA.palette.curves[1])], seen = {true: 0, false: 0};
  const names = [...new Set(ground.shapes.map((shape) => `${shape.solid} ${shape.what}`))];
  const shapes = names.map((name) => {
    const same = ground.shapes.filter((shape) => `${shape.solid} ${shape.what}` === name), own = seen[same[0].solid]++;
    const colour = same[0].solid ? solid[own % solid.length] : lying[own % lying.length];
    return {type: "scatter", mode: "lines", name: same[0].what, uid: uidOf(`ground ${name}`), ...together(same), fill: "toself", hoveron: "fills", text: same[0].what,
            hoverinfo: "text", line: {color: colour, width: 1.2}, ...(same[0].solid ? {fillcolor: faded(colour, 0.85)}
              : {fillcolor: faded(colour, 0.16), fillpattern: {shape: "/", fgcolor: faded(colour, 0.55), bgcolor: faded(colour, 0.12), size: 9, solidity: 0.2}})};
  });
  return [{type: "scatter", mode: "lines", name: "area", uid: "area", x: [west, east, east, west, west], y: [south, south, north, north, south], hoverinfo: "skip",
           line: {color: css("--ink"), width: 1.6}}, ...shapes];
}

// The polygons that events drew and that are there now.
function polygonTraces(now) {
  const kinds = [...new Set(DATA.marks.polygons.map((shape) => shape.what))];
  return kinds.map((kind, k) => {
    const there = DATA.marks.polygons.filter((shape) => shape.what === kind && shape.from_s <= now + 1e-9 && now < shape.until_s);
    const colour = pick(DATA.palette.marks[(k + 2) % DATA.palette.marks.length]);
    return {type: "scatter", mode: "lines", name: kind, uid: uidOf(`polygon ${kind}`), ...(there.length ? together(there) : {x: [null], y: [null]}), fill: "toself",
            fillcolor: faded(colour, 0.22), line: {color: colour, width: 1.6, dash: "dash"}, hoveron: "fills", hoverinfo: "text",
            text: there.map((shape) => shape.text).join("<br>")};
  });
}

// The modes of each body at the instants of the animation, -1 where it is out of the picture; and all that occur, in order.
const modesOf = new Map();
function modesOfBody(body) {
  if (!modesOf.has(body.label)) modesOf.set(body.label, DATA.plane.instants_s.map((t_s, j) => body.x[j] === null ? -1 : modeAt(body.label, t_s)));
  return modesOf.get(body.label);
}
let modesShown = null;
function modesInPlane() {
  if (modesShown === null) {
    const shown = new Set(DATA.plane.bodies.flatMap(modesOfBody));
    modesShown = DATA.modes.names.map((_, k) => k).filter((k) => shown.has(k));
  }
  return modesShown;
}
const turns = (body) => new Set((body.heading || []).filter((value) => value !== null).map((value) => value.toFixed(2))).size > 1;

function viewsInModes(views, k, now, turned) {
  if (!views.length) return [];
  const modes = views.map((view) => modeAt(view.body.label, now));
  return [...new Set([...views.flatMap((view) => staysOf.get(view.body.label).mode), -1])].sort((a, b) => a - b).map((mode) => {
    const own = views.filter((_, j) => modes[j] === mode), colour = mode < 0 ? css("--soft") : modeColour(mode);
    const outline = own.length ? together(own.map((view) => outlineOf(view, k, turned(view.body)))) : {x: [null], y: [null]};
    return {type: "scatter", mode: "lines", uid: uidOf(`view ${mode}`), legendgroup: "views", showlegend: false, ...outline, fill: mode < 0 ? "none" : "toself", hoverinfo: "skip",
            fillcolor: mode < 0 ? "rgba(0,0,0,0)" : faded(colour, 0.13), line: {color: colour, width: 1.6, dash: mode < 0 ? "dot" : modeDash(mode)}};
  }).concat({type: "scatter", mode: "lines", name: "field of view", uid: "views", legendgroup: "views", x: [null], y: [null], fill: "toself",
             fillcolor: faded(pick(DATA.palette.curves[6]), 0.25), line: {color: css("--soft"), width: 1.6}});
}

// The ways until now, each part in the colour of the mode in which it was driven.
function waysInModes(bodies, k) {
  if (!bodies.length) return [];
  const ways = new Map(modesInPlane().map((mode) => [mode, {x: [], y: []}]));
  bodies.forEach((body) => {
    const modes = modesOfBody(body);
    let last = -1;
    for (let j = 0; j <= k; j++) {
      const mode = modes[j];
      if (last >= 0 && mode !== last) {
        const way = ways.get(last);
        way.x.push(body.x[j], null); way.y.push(body.y[j], null);
      }
      if (mode >= 0) { ways.get(mode).x.push(body.x[j]); ways.get(mode).y.push(body.y[j]); }
      last = mode;
    }
    if (last >= 0) { ways.get(last).x.push(null); ways.get(last).y.push(null); }
  });
  return [...ways].map(([mode, way]) => ({
    type: "scatter", mode: "lines", name: DATA.modes.names[mode], uid: uidOf(`way ${mode}`), legendgroup: "ways", showlegend: false, x: way.x.length ? way.x : [null],
    y: way.y.length ? way.y : [null], hoverinfo: "skip", line: {color: modeColour(mode), width: 1.8, dash: modeDash(mode)}}));
}

function robotsInModes(bodies, k, now) {
  if (!bodies.length) return [];
  const modes = bodies.map((body) => modeAt(body.label, now)), initial = new Set(DATA.modes.initial);
  const colours = modes.map((mode) => mode < 0 ? css("--soft") : modeColour(mode));
  const symbols = bodies.map((body) => symbolOf(body.label)), turned = bodies.filter((body) => turns(body) && body.heading[k] !== null);
  const [[west, east]] = planeRanges(), tick = (east - west) / 32;
  const word = (j) => modes[j] < 0 ? "no mode" : DATA.modes.names[modes[j]];
  const legend = (name, marker, style) => ({type: "scatter", mode: style ? "lines+markers" : "markers", name, uid: uidOf(`legend ${name}`), x: [null], y: [null], marker, line: style || {}});
  return [
    {type: "scatter", mode: "lines", uid: "headings", showlegend: false, hoverinfo: "skip", line: {color: css("--ink"), width: 2.5},
     x: turned.length ? turned.flatMap((body) => [body.x[k], body.x[k] + tick * Math.cos(body.heading[k]), null]) : [null],
     y: turned.length ? turned.flatMap((body) => [body.y[k], body.y[k] + tick * Math.sin(body.heading[k]), null]) : [null]},
    {type: "scatter", mode: "markers", uid: "robots", showlegend: false, x: bodies.map((body) => body.x[k]), y: bodies.map((body) => body.y[k]),
     marker: {size: 14, color: colours, symbol: symbols, line: {width: 1.2, color: css("--ink")}},
     text: bodies.map((body, j) => `${body.label}: ${word(j)}`), hovertemplate: "%{text}<br>%{x:.4g} m, %{y:.4g} m<extra></extra>"},
    {type: "scatter", mode: "markers+text", name: "names", uid: "names", marker: {size: 16, color: "rgba(0,0,0,0)"}, x: bodies.map((body) => body.x[k]), y: bodies.map((body) => body.y[k]), hoverinfo: "skip",
     text: bodies.map((body, j) => !initial.has(word(j)) ? `<b>${body.label}</b><br><i>${word(j)}</i>` : body.label), textposition: "top center",
     textfont: {size: 11, color: css("--ink"), shadow: halo()}},
    ...programs.filter((program) => bodies.some((body) => DATA.modes.programs[DATA.modes.nodes.indexOf(body.label)] === program)).map((program) =>
      legend(program, {size: 11, color: "rgba(0,0,0,0)", symbol: PROGRAM_SYMBOLS[programs.indexOf(program) % PROGRAM_SYMBOLS.length], line: {width: 1.4, color: css("--ink")}})),
    ...modesInPlane().map((mode) => legend(DATA.modes.names[mode], {size: 8, color: modeColour(mode), symbol: "circle"},
                                           {color: modeColour(mode), width: 1.8, dash: modeDash(mode)}))];
}

// Events with named values: those with a place stay as points, the newest large; others are words at their robot for a second.
function markTraces(k, now) {
  const bodies = new Map(DATA.plane.bodies.map((body) => [body.label, body]));
  const said = new Map();
  const traces = DATA.marks.kinds.flatMap((kind, j) => {
    const until = firstFrom(kind.t_s, now + 1e-9), rows = [];
    for (let row = 0; row < until; row++) {
      if (kind.x[row] !== null) rows.push(row);
      else if (kind.t_s[row] > now - 1 && bodies.has(kind.node[row])) {
        const words = said.get(kind.node[row]) || [];
        said.set(kind.node[row], [...words.filter((other) => !other.startsWith(kind.kind)), kind.words[row]]);     // the newest of a kind
      }
    }
    if (!kind.x.some((value) => value !== null)) return [];
    const shown = rows.slice(-MOST_DETECTIONS), fresh = shown.map((row) => kind.t_s[row] > now - 1), {symbol, color} = markStyle(j);
    return [{type: "scatter", mode: "markers", name: kind.kind, showlegend: false, uid: uidOf(`mark ${kind.kind}`), x: shown.length ? shown.map((row) => kind.x[row]) : [null],
             y: shown.length ? shown.map((row) => kind.y[row]) : [null], text: shown.map((row) => wrapped(kind.text[row])), hovertemplate: "%{text}<extra></extra>",
             marker: {symbol: shown.length ? fresh.map((yes) => yes ? `${symbol}-open` : symbol) : symbol, color: shown.length ? fresh.map((yes) => yes ? css("--ink") : color) : color,
                      opacity: 1, size: shown.length ? fresh.map((yes) => yes ? 24 : 11) : 11, line: {width: shown.length ? fresh.map((yes) => yes ? 2.5 : 1) : 1, color: css("--ink")}}},
            {type: "scatter", mode: "markers", name: kind.kind, uid: uidOf(`legend mark ${kind.kind}`), x: [null], y: [null],
             marker: {symbol, color, size: 11, line: {width: 1, color: css("--ink")}}}];
  });
  const nodes = [...said.keys()];
  traces.push({type: "scatter", mode: "markers+text", marker: {size: 16, color: "rgba(0,0,0,0)"}, name: "words", uid: "words", showlegend: false, hoverinfo: "skip", textposition: "bottom center",
               textfont: {size: 11, color: css("--accent"), shadow: halo()}, x: nodes.length ? nodes.map((node) => bodies.get(node).x[k]) : [null],
               y: nodes.length ? nodes.map((node) => bodies.get(node).y[k]) : [null], text: nodes.map((node) => said.get(node).join("<br>"))});
  return DATA.marks.kinds.length ? traces : [];
}
