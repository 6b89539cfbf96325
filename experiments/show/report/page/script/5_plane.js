// The plane at one instant: where everybody is, the way that led there, fields of view, ground, marks and looks until then.
function drawPlane() {
  const p = DATA.plane, k = Number(byId("plane-at").value), now = p.instants_s[k];
  const frame_s = p.instants_s[p.instants_s.length - 1] / Math.max(1, p.instants_s.length - 1), recent_s = Math.max(0.3, 1.5 * frame_s);
  const turned = (body) => body.heading && body.heading[k] !== null ? body.heading[k] : 0;
  const looks = p.looks.filter((look) => look.t_s <= now && look.x !== null);
  const looking = new Set(looks.filter((look) => look.t_s > now - recent_s).map((look) => look.observer));
  const inModes = p.bodies.filter((body) => staysOf.has(body.label)), others = p.bodies.filter((body) => !staysOf.has(body.label));
  const traces = [...polygonTraces(now), ...groundTraces()];
  const seen = p.views.map((view) => ({...view, body: p.bodies.find((one) => one.label === view.carrier)}))
    .filter((view) => view.body && view.body.x[k] !== null);
  seen.filter((view) => others.includes(view.body)).forEach((view) => {
    const active = looking.has(view.observer);
    traces.push({type: "scatter", mode: "lines", fill: "toself", ...outlineOf(view, k, turned(view.body)), hoverinfo: "skip", opacity: active ? 0.6 : 0.25,
                 showlegend: false, line: {color: line(view.body.label).color, width: active ? 2.5 : 0.8}});
  });
  traces.push(...viewsInModes(seen.filter((view) => inModes.includes(view.body)), k, now, turned));
  const marks = (name, chosen, marker) => {
    if (chosen.length) traces.push({type: "scatter", mode: "markers", name, x: chosen.map((look) => look.x), y: chosen.map((look) => look.y), marker,
      text: chosen.map((look) => `${look.observer} looks at ${look.body}, ${look.t_s.toFixed(3)} s: ${look.fate}`), hovertemplate: "%{text}<extra></extra>"});
  };
  const fresh = looks.filter((look) => look.t_s > now - recent_s);
  marks("looks", looks.filter((look) => look.seen && look.t_s <= now - recent_s), {size: 6, opacity: 0.35, color: css("--soft"), symbol: "circle-open"});
  const way = (body, style) => traces.push({
    type: "scatter", mode: "lines", name: body.label, legendgroup: body.label, x: body.x.slice(0, k + 1), y: body.y.slice(0, k + 1),
    line: style, hoverinfo: "skip"});
  traces.push(...waysInModes(inModes, k));
  others.forEach((body) => way(body, line(body.label)));
  p.believed.forEach((body, j) => {
    const colour = line(body.body).color, before = p.believed.slice(0, j).filter((one) => one.body === body.body).length;
    way(body, {color: colour, width: 1, dash: ["dot", "dash", "dashdot"][before % 3]});
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
  marks("looks lost on the way", looks.filter((look) => !look.seen && !look.unseen),
    {size: 5, color: violatedColour(), symbol: "x-thin", line: {width: 1, color: violatedColour()}});
  marks("not in view just now", fresh.filter((look) => look.unseen), {size: 11, color: violatedColour(), symbol: "x-open"});
  traces.push(...robotsInModes(inModes, k, now));
  others.forEach((body) => traces.push({
    type: "scatter", mode: "markers", legendgroup: body.label, showlegend: false, x: [body.x[k]], y: [body.y[k]],
    marker: {color: line(body.label).color, size: 14, symbol: body.heading ? "arrow" : "circle",
             angle: 90 - turned(body) * 180 / Math.PI, line: {width: 1, color: css("--ink")}},
    hovertemplate: `${body.label}: %{x:.4g} m, %{y:.4g} m<extra></extra>`}));
  traces.push(...markTraces(k, now));
  const broken = DATA.violated.some((stretch) => stretch.from_s <= now && now < stretch.until_s);
  byId("plane-time").textContent = `${+now.toFixed(3)} s${broken ? ", a guarantee is violated" : ""}`;
  byId("plane-time").style.color = broken ? violatedColour() : "";
  byId("plane-note").textContent = p.looks.length < p.looks_total ? `${p.looks.length} of ${p.looks_total} looks drawn: the first ones in view` : "";
  if (byId("plane-told")) byId("plane-told").replaceChildren(...toldAt(now).map((words) => Object.assign(document.createElement("li"), {textContent: words})));
  const shapes = p.obstacles.map((o) => ({type: "circle", x0: o.x - o.radius_m, x1: o.x + o.radius_m, y0: o.y - o.radius_m,
                                          y1: o.y + o.radius_m, fillcolor: css("--soft"), opacity: 0.5, line: {width: 0}}));
  const [xs, ys] = planeRanges();
  Plotly.react("plot-plane", traces, layout("x [m]", "y [m]", {
    shapes, hovermode: "closest", showlegend: true, height: narrow.matches ? 520 : p.ground ? 660 : 640,
    legend: narrow.matches ? {orientation: "h", y: -0.16, yanchor: "top", x: 0} : {orientation: "v", x: 1.01, y: 1, yanchor: "top"},
    margin: {...layout("", "").margin, t: 30}, modebar: {...layout("", "").modebar, orientation: "h"},      // above the legend
    xaxis: {range: xs, constrain: "domain"}, yaxis: {range: ys, scaleanchor: "x", constrain: "domain"}, uirevision: "plane"}), config());
}

// The outline of a field of view that a body carries: a circle or a sector.
function outlineOf(view, k, heading) {
  const half = view.half_angle_deg * Math.PI / 180;
  const angles = [...Array(61).keys()].map((j) => heading - half + 2 * half * j / 60);
  const xs = angles.map((a) => view.body.x[k] + view.range_m * Math.cos(a)), ys = angles.map((a) => view.body.y[k] + view.range_m * Math.sin(a));
  if (view.half_angle_deg < 180) { xs.unshift(view.body.x[k]); ys.unshift(view.body.y[k]); }
  return {x: xs, y: ys};
}

// The same for all instants, so that nothing jumps; what is believed of a lost target may run out of the picture.
function planeRanges() {
  const p = DATA.plane, all = p.bodies, reach = Math.max(0, ...p.views.map((view) => view.range_m));
  if (p.ground) return p.ground.picture;
  return ["path_x", "path_y"].map((axis) => {
    const values = all.flatMap((body) => body[axis]).filter((value) => value !== null);
    const low = Math.min(...values), high = Math.max(...values), room = reach + 0.06 * (high - low) + 0.05;
    return [low - room, high + room];
  });
}

let playing = null;
function stopPlane() {
  if (playing !== null) cancelAnimationFrame(playing);
  playing = null;
  byId("plane-play").textContent = "▶ play";
}

function playPlane() {
  const slider = byId("plane-at"), last = Number(slider.max), instants = DATA.plane.instants_s;
  if (playing !== null) { stopPlane(); return; }
  if (Number(slider.value) >= last) { slider.value = 0; drawPlane(); }
  const from_s = instants[Number(slider.value)], started = performance.now();
  byId("plane-play").textContent = "❚❚ pause";
  const advance = (wall) => {
    const now_s = from_s + Number(byId("plane-speed").value) * (wall - started) / 1000;
    const k = Math.min(last, Math.max(0, firstFrom(instants, now_s)));
    if (k !== Number(slider.value)) { slider.value = k; drawPlane(); }
    if (k >= last) stopPlane(); else playing = requestAnimationFrame(advance);
  };
  playing = requestAnimationFrame(advance);
}

// To the next instant at which something is told (sign 1), or the one before (-1).
function nextTold(sign) {
  const slider = byId("plane-at"), instants = DATA.plane.instants_s, now = instants[Number(slider.value)];
  const after = firstFrom(toldInstants, now + (sign > 0 ? 1e-9 : -1e-9)), k = sign > 0 ? after : after - 1;
  if (k < 0 || k >= toldInstants.length) return;
  stopPlane();
  slider.value = firstFrom(instants, toldInstants[k] - 1e-9);
  drawPlane();
}
