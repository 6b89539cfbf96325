// The map: ground, zones, fields of view, nodes with their way so far, and links that light up when copies end on them.
const LIT_MS = 700, MOST_TRAIL = 80, EDGE = 34, LABEL = "12px system-ui, sans-serif";
const MAP = {box: null, lit: new Map(), spoke: new Map(), trails: {}, points: new Map(), labels: new Map(), due: false};

// Take an update: which links have new copies, and which way the nodes went. `first`: all that happened before is in it.
function noteOnMap(changed, at, before, first) {
  const now = performance.now();
  if (!first) {
    changed.forEach((count) => {
      const [medium, sender, receiver] = RUN.links[count.place], old = before.get(count.place) || {};
      let worst = null, most = 0;
      Object.entries(count.fates).forEach(([fate, copies]) => {
        const more = copies - (old[fate] || 0);
        if (more <= 0 || unseen(fate)) return;
        MAP.spoke.set(sender, now);
        if (arrived(fate)) MAP.lit.set(`${sender} ${receiver} +`, {sender, receiver, fate, at: now});
        else if (more > most) [worst, most] = [fate, more];
      });
      if (worst) MAP.lit.set(`${sender} ${receiver} -`, {sender, receiver, fate: worst, at: now});
    });
  }
  Object.entries(at).forEach(([node, [x, y]]) => {
    if (x === null || y === null) return;
    const trail = MAP.trails[node] = MAP.trails[node] || [];
    trail.push([x, y]);
    if (trail.length > MOST_TRAIL) trail.shift();
    grow(x, y);
  });
  drawMapSoon();
}

function grow(x, y) {
  const ground = RUN.scene.ground;
  if (ground) return;
  const box = MAP.box = MAP.box || {west: x, east: x, south: y, north: y};
  box.west = Math.min(box.west, x);
  box.east = Math.max(box.east, x);
  box.south = Math.min(box.south, y);
  box.north = Math.max(box.north, y);
}

function startMap() {
  const scene = RUN.scene;
  Object.assign(MAP, {box: null, trails: {}});
  MAP.lit.clear();
  MAP.spoke.clear();
  if (scene.ground) {
    const [[west, east], [south, north]] = scene.ground.picture;
    MAP.box = {west, east, south, north};
  }
  scene.nodes.forEach((node) => { if (node.at) grow(node.at[0], node.at[1]); });
  scene.zones.forEach((zone) => zone.corners.forEach(([x, y]) => grow(x, y)));
  scene.obstacles.forEach((o) => { grow(o.at[0] - o.radius_m, o.at[1] - o.radius_m); grow(o.at[0] + o.radius_m, o.at[1] + o.radius_m); });
  drawMapSoon();
}

function drawMapSoon() {
  if (MAP.due) return;
  MAP.due = true;
  requestAnimationFrame(() => { MAP.due = false; drawMap(); });
}

// Where nodes are drawn, in pixels: by their positions; those without one in a circle, or in a row below those that have one.
function placeNodes(width, height) {
  const nodes = RUN.scene.nodes, placed = new Map(), stray = [];
  const positionOf = (node) => RUN.at[node.name] && RUN.at[node.name][0] !== null ? RUN.at[node.name] : node.at ? [...node.at, null] : null;
  const box = MAP.box, room = nodes.some((node) => !positionOf(node)) && box ? 44 : 0;
  const wide = box ? Math.max(box.east - box.west, 1e-6) : 1, high = box ? Math.max(box.north - box.south, 1e-6) : 1;
  const span_m = Math.max(wide, high, box && !RUN.scene.ground ? 1 : 0);
  const scale = Math.min((width - 2 * EDGE) / Math.max(wide, span_m / 3), (height - 2 * EDGE - room) / Math.max(high, span_m / 3));
  const middle = box ? [(box.west + box.east) / 2, (box.south + box.north) / 2] : [0, 0];
  const pixel = (x, y) => [width / 2 + (x - middle[0]) * scale, (height - room) / 2 - (y - middle[1]) * scale];
  let outside = 0;
  nodes.forEach((node, index) => {
    const at = positionOf(node);
    if (!at) return stray.push(node);
    const [x, y] = pixel(at[0], at[1]);
    if (RUN.scene.ground && (at[0] < box.west || at[0] > box.east || at[1] < box.south || at[1] > box.north)) outside += 1;
    else placed.set(node.name, {x, y, heading: at[2], index});
  });
  const indexOf = (node) => nodes.indexOf(node);
  stray.forEach((node, k) => {
    const angle = Math.PI / 2 - 2 * Math.PI * k / stray.length, radius = Math.min(width, height) / 2 - 56;
    placed.set(node.name, box ? {x: (k + 1) * width / (stray.length + 1), y: height - 30, heading: null, index: indexOf(node)}
      : {x: width / 2 + radius * Math.cos(angle), y: height / 2 - radius * Math.sin(angle), heading: null, index: indexOf(node)});
  });
  return {placed, pixel, scale, stray: stray.length, outside};
}

function polygon(pen, corners, pixel) {
  pen.beginPath();
  corners.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](...pixel(x, y)));
  pen.closePath();
}

function drawGround(pen, view) {
  const scene = RUN.scene, {pixel, scale} = view;
  if (scene.ground) {
    const [[west, east], [south, north]] = scene.ground.area;
    pen.strokeStyle = css("--soft");
    pen.lineWidth = 1.4;
    polygon(pen, [[west, south], [east, south], [east, north], [west, north]], pixel);
    pen.stroke();
    scene.ground.shapes.forEach((shape) => {
      polygon(pen, shape.x.map((x, k) => [x, shape.y[k]]), pixel);
      pen.globalAlpha = shape.solid ? 0.5 : 0.14;
      pen.fillStyle = shape.solid ? css("--soft") : css("--bad");
      pen.fill();
      pen.globalAlpha = 1;
      if (!shape.solid) { pen.strokeStyle = css("--bad"); pen.setLineDash([5, 4]); pen.lineWidth = 1; pen.stroke(); pen.setLineDash([]); }
    });
  }
  scene.zones.forEach((zone) => {
    polygon(pen, zone.corners, pixel);
    pen.fillStyle = css("--bad");
    pen.globalAlpha = 0.1;
    pen.fill();
    pen.globalAlpha = 0.7;
    pen.setLineDash([5, 4]);
    pen.strokeStyle = css("--bad");
    pen.lineWidth = 1;
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
  });
  scene.obstacles.forEach((o) => {
    pen.beginPath();
    pen.arc(...pixel(o.at[0], o.at[1]), o.radius_m * scale, 0, 2 * Math.PI);
    pen.globalAlpha = 0.5;
    pen.fillStyle = css("--soft");
    pen.fill();
    pen.globalAlpha = 1;
  });
}

function drawViews(pen, view) {
  RUN.scene.views.forEach((field) => {
    const spot = view.placed.get(field.carrier);
    if (!spot || (spot.heading === null && field.half_angle_deg < 180)) return;
    const half = field.half_angle_deg * Math.PI / 180, ahead = -(spot.heading || 0);
    pen.beginPath();
    if (half < Math.PI) pen.moveTo(spot.x, spot.y);
    pen.arc(spot.x, spot.y, field.range_m * view.scale, ahead - half, ahead + half);
    pen.closePath();
    pen.globalAlpha = 0.09;
    pen.fillStyle = nodeColour(spot.index);
    pen.fill();
    pen.globalAlpha = 1;
  });
}

// A little beside the straight line, so that the two directions are apart.
function drawLit(pen, view, now) {
  const many = Math.min(1, 60 / Math.max(1, MAP.lit.size));
  MAP.lit.forEach((lit, key) => {
    const left = 1 - (now - lit.at) / LIT_MS, from = view.placed.get(lit.sender), to = view.placed.get(lit.receiver);
    if (left <= 0) return MAP.lit.delete(key);
    if (!from || !to) return;
    const dx = to.x - from.x, dy = to.y - from.y, far = Math.hypot(dx, dy);
    pen.strokeStyle = pen.fillStyle = fateColour(lit.fate);
    pen.globalAlpha = left * Math.max(0.16, many * 0.85);
    pen.lineWidth = arrived(lit.fate) ? 1.8 : 1.4;
    pen.setLineDash(arrived(lit.fate) ? [] : [6, 4]);
    if (far < 14) {
      pen.beginPath();
      pen.arc(from.x, from.y - 14, 7, 0, 2 * Math.PI);
      pen.stroke();
      return;
    }
    const ux = dx / far, uy = dy / far, sx = -uy * 3, sy = ux * 3, end = far - 11;
    const x1 = from.x + ux * 9 + sx, y1 = from.y + uy * 9 + sy, x2 = from.x + ux * end + sx, y2 = from.y + uy * end + sy;
    pen.beginPath();
    pen.moveTo(x1, y1);
    pen.lineTo(x2, y2);
    pen.stroke();
    pen.setLineDash([]);
    pen.beginPath();
    pen.moveTo(x2, y2);
    pen.lineTo(x2 - ux * 8 - uy * 4, y2 - uy * 8 + ux * 4);
    pen.lineTo(x2 - ux * 8 + uy * 4, y2 - uy * 8 - ux * 4);
    pen.closePath();
    pen.fill();
  });
  pen.setLineDash([]);
  pen.globalAlpha = 1;
}

function drawNodes(pen, view, now) {
  const ink = css("--ink"), card = css("--card"), soft = css("--soft"), many = view.placed.size > 24;
  view.placed.forEach((spot, name) => {
    const trail = MAP.trails[name] || [];
    if (trail.length > 1) {
      pen.beginPath();
      trail.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](...view.pixel(x, y)));
      pen.strokeStyle = nodeColour(spot.index);
      pen.globalAlpha = 0.4;
      pen.lineWidth = 1.2;
      pen.stroke();
      pen.globalAlpha = 1;
    }
  });
  MAP.spoke.forEach((at, name) => {
    const left = 1 - (now - at) / LIT_MS, spot = view.placed.get(name);
    if (left <= 0) return MAP.spoke.delete(name);
    if (!spot) return;
    pen.beginPath();
    pen.arc(spot.x, spot.y, 8 + (1 - left) * 9, 0, 2 * Math.PI);
    pen.strokeStyle = nodeColour(spot.index);
    pen.globalAlpha = left * 0.8;
    pen.lineWidth = 2;
    pen.stroke();
    pen.globalAlpha = 1;
  });
  const radius = many ? 5 : 7;
  view.placed.forEach((spot, name) => {
    const away = RUN.away[name];
    pen.fillStyle = away ? soft : nodeColour(spot.index);
    pen.strokeStyle = card;
    pen.lineWidth = 1.5;
    pen.beginPath();
    if (spot.heading !== null && spot.heading !== undefined) {
      const point = (turn, far) => [spot.x + far * Math.cos(spot.heading + turn), spot.y - far * Math.sin(spot.heading + turn)];
      pen.moveTo(...point(0, radius * 1.7));
      pen.lineTo(...point(2.4, radius * 1.3));
      pen.lineTo(...point(Math.PI, radius * 0.4));
      pen.lineTo(...point(-2.4, radius * 1.3));
      pen.closePath();
    } else pen.arc(spot.x, spot.y, radius, 0, 2 * Math.PI);
    pen.fill();
    pen.stroke();
    if (away) {
      pen.strokeStyle = css("--bad");
      pen.lineWidth = 2.4;
      pen.beginPath();
      if (away === "dead") { pen.moveTo(spot.x - 7, spot.y - 7); pen.lineTo(spot.x + 7, spot.y + 7); pen.moveTo(spot.x + 7, spot.y - 7); pen.lineTo(spot.x - 7, spot.y + 7); }
      else { pen.moveTo(spot.x - 3, spot.y - 7); pen.lineTo(spot.x - 3, spot.y + 7); pen.moveTo(spot.x + 3, spot.y - 7); pen.lineTo(spot.x + 3, spot.y + 7); }
      pen.stroke();
    }
    if (name === RUN.chosen) {
      pen.strokeStyle = css("--accent");
      pen.lineWidth = 2;
      pen.beginPath();
      pen.arc(spot.x, spot.y, 14, 0, 2 * Math.PI);
      pen.stroke();
    }
  });
  drawLabels(pen, view, many ? "10.5px system-ui, sans-serif" : LABEL, ink, card);
}

// Names where there is room for them: that of the chosen node first, others in order. Most links go to the middle of the
// nodes, so the places on the other side come first.
function drawLabels(pen, view, font, ink, card) {
  const all = [...view.placed.values()], mean = (axis) => all.reduce((total, spot) => total + spot[axis], 0) / all.length;
  const middle = {x: mean("x"), y: mean("y")}, taken = [], spots = [...view.placed.entries()].sort(([one], [other]) => (other === RUN.chosen) - (one === RUN.chosen));
  pen.font = font;
  pen.textBaseline = "middle";
  MAP.labels.clear();
  spots.forEach(([name, spot]) => {
    const away = RUN.away[name], text = away ? `${name}: ${away}` : name, width = pen.measureText(text).width;
    const away_x = spot.x - middle.x, away_y = spot.y - middle.y, inwards = ([right, down]) => -(right * away_x + down * away_y);
    const places = [[1, -1], [-1, -1], [1, 1], [-1, 1]].sort((one, other) => inwards(one) - inwards(other))
      .map(([right, down]) => [right > 0 ? spot.x + 11 : spot.x - 11 - width, spot.y + 11 * down]);
    const fits = places.find(([x, y]) => x > 2 && x + width < view.width - 2 && y > 8 && y < view.height - 8
      && taken.every((box) => x + width < box[0] || x > box[2] || y + 7 < box[1] || y - 7 > box[3])
      && all.every((other) => other === spot || other.x < x - 6 || other.x > x + width + 6 || Math.abs(other.y - y) > 11));
    if (!fits) return;
    const [x, y] = fits;
    taken.push([x, y - 7, x + width, y + 7]);
    MAP.labels.set(name, {x, y, width});
    pen.lineWidth = 3;
    pen.strokeStyle = card;
    pen.lineJoin = "round";
    pen.strokeText(text, x, y);
    pen.fillStyle = away ? css("--bad") : ink;
    pen.fillText(text, x, y);
  });
}

// A bar of a round length, to read distances by.
function drawScale(pen, view) {
  if (!MAP.box) return;
  const metres = [1, 2, 5].flatMap((d) => [-3, -2, -1, 0, 1, 2, 3, 4].map((e) => d * 10 ** e)).sort((a, b) => a - b)
    .filter((length) => length * view.scale < 140).pop();
  if (!metres) return;
  const y = view.height - 12, x = 14;
  pen.strokeStyle = pen.fillStyle = css("--soft");
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(x, y - 4);
  pen.lineTo(x, y);
  pen.lineTo(x + metres * view.scale, y);
  pen.lineTo(x + metres * view.scale, y - 4);
  pen.stroke();
  pen.font = "11px system-ui, sans-serif";
  pen.textBaseline = "alphabetic";
  pen.fillText(`${+metres.toPrecision(1)} m`, x + 5, y - 5);
}

function drawMap() {
  if (!RUN.scene) return;
  const canvas = byId("map"), width = canvas.clientWidth, height = canvas.clientHeight, now = performance.now();
  const pen = clearCanvas(canvas, width, height), view = {...placeNodes(width, height), width, height};
  MAP.points = view.placed;
  drawGround(pen, view);
  drawViews(pen, view);
  drawLit(pen, view, now);
  drawNodes(pen, view, now);
  drawScale(pen, view);
  const notes = [];
  if (!MAP.box) notes.push("No node has a position: they stand in a circle.");
  else if (view.stray) notes.push(`In a row below: ${view.stray} without a position.`);
  if (view.outside) notes.push(`${view.outside} outside the area, not drawn.`);
  notes.push("A link lights up when copies end on it: whole if they arrived, dashed if not, in the colour of the fate.");
  byId("map-note").textContent = notes.join(" ");
  if (MAP.lit.size || MAP.spoke.size) drawMapSoon();
}

byId("map").addEventListener("click", (event) => {
  const spots = [...MAP.points.entries()].map(([name, spot]) => [Math.hypot(spot.x - event.offsetX, spot.y - event.offsetY), name]).sort((a, b) => a[0] - b[0]);
  if (spots.length && spots[0][0] < 24) choose(spots[0][1]);
});
addEventListener("resize", drawMapSoon);
