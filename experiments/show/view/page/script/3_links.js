// Fates and age of information by link: a table of few links, a matrix of senders and receivers of many.
const LINKS = {rows: new Map(), legend: new Map(), cells: [], due: false};

function startLinks() {
  const media = Object.keys(RUN.scene.media);
  byId("medium").replaceChildren(...media.map((name) => Object.assign(element("option", name), {value: name})));
  if (media.length > 1) byId("medium").prepend(Object.assign(element("option", "all"), {value: ""}));
  byId("medium").selectedIndex = 0;
  LINKS.rows.clear();
  LINKS.legend.clear();
  byId("legend").replaceChildren();
  byId("link-table").tBodies[0].replaceChildren();
}

const linksShown = () => RUN.counts.filter((count) => count && (!byId("medium").value || RUN.links[count.place][0] === byId("medium").value));

function drawLinks() {
  if (!RUN.scene) return;
  const shown = linksShown(), table = shown.length <= MOST_LINKS_IN_TABLE;
  drawLegend(shown);
  byId("link-table").hidden = !table;
  byId("matrix").hidden = table;
  if (table) drawLinkTable(shown);
  else drawMatrix(shown);
  byId("link-note").textContent = shown.length ? table ? "" : LINKS.told || "Rows are senders, columns receivers. Point at a cell to read it."
    : "No copy has ended yet.";
}

function drawLegend(shown) {
  const total = {};
  shown.forEach((count) => Object.entries(count.fates).forEach(([fate, copies]) => { total[fate] = (total[fate] || 0) + copies; }));
  Object.keys(RUN.scene.fates).forEach((fate) => {
    let entry = LINKS.legend.get(fate);
    if (!total[fate]) { if (entry) entry.remove(); LINKS.legend.delete(fate); return; }
    if (!entry) {
      entry = element("div");
      const name = element("dt"), chip = element("i", "", "chip");
      chip.style.background = fateColour(fate);
      name.append(chip, fate);
      entry.title = RUN.scene.fates[fate];
      entry.append(name, element("dd"));
      byId("legend").append(entry);
      LINKS.legend.set(fate, entry);
    }
    entry.lastChild.textContent = total[fate].toLocaleString("en");
  });
}

function drawLinkTable(shown) {
  const age = byId("what").value === "age", several = !byId("medium").value, table = byId("link-table");
  const titles = [...(several ? ["medium"] : []), "link", "copies", "arrived", age ? "age" : "fates", age ? "" : "age"];
  if (table.tHead.textContent !== titles.join("")) {
    const row = element("tr");
    titles.forEach((title) => row.append(element("th", title, ["copies", "arrived"].includes(title) || (title === "age" && !age) ? "n" : "")));
    table.tHead.replaceChildren(row);
    LINKS.rows.clear();
    table.tBodies[0].replaceChildren();
  }
  const wanted = new Set(shown.map((count) => count.place));
  LINKS.rows.forEach((row, place) => { if (!wanted.has(place)) { row.remove(); LINKS.rows.delete(place); } });
  const oldest = Math.max(1, ...shown.map(ageOf));
  shown.forEach((count) => {
    const [medium, sender, receiver] = RUN.links[count.place];
    let row = LINKS.rows.get(count.place);
    if (!row) {
      row = element("tr");
      if (several) row.append(element("td", medium, "name"));
      row.append(element("td", `${sender} → ${receiver}`, "name"), element("td", "", "n"), element("td", "", "n"), element("td"), element("td", "", "n"));
      row.cells[row.cells.length - 2].append(element("div", "", "bar"));
      row.cells[row.cells.length - 2].style.width = "45%";
      LINKS.rows.set(count.place, row);
      const later = [...LINKS.rows.keys()].filter((place) => orderOf(place) > orderOf(count.place)).sort((a, b) => orderOf(a) < orderOf(b) ? -1 : 1)[0];
      table.tBodies[0].insertBefore(row, later === undefined ? null : LINKS.rows.get(later));
    }
    const cells = [...row.cells].slice(several ? 2 : 1), total = sum(count.fates), bar = cells[2].firstChild;
    cells[0].textContent = total.toLocaleString("en");
    const meant = meantOf(count.fates);
    cells[1].textContent = meant ? `${(100 * arrivedOf(count.fates) / meant).toFixed(1)} %` : "–";
    cells[3].textContent = span(ageOf(count));
    const parts = age ? [[Math.max(0, ageOf(count)) / oldest, pick(RUN.scene.palette.middle), span(ageOf(count))]]
      : Object.keys(RUN.scene.fates).filter((fate) => count.fates[fate])
        .map((fate) => [count.fates[fate] / total, fateColour(fate), `${count.fates[fate]} ${fate}`]);
    while (bar.children.length > parts.length) bar.lastChild.remove();
    parts.forEach(([share, colour, words], k) => {
      const part = bar.children[k] || bar.appendChild(element("i"));
      part.style.width = `${100 * share}%`;
      part.style.background = colour;
      part.title = words;
    });
  });
}

const orderOf = (place) => RUN.links[place].join(" ");

function mix(one, other, share) {
  const part = (text, at) => parseInt(text.slice(at, at + 2), 16);
  return `rgb(${[1, 3, 5].map((at) => Math.round(part(one, at) * (1 - share) + part(other, at) * share)).join(",")})`;
}

function drawMatrix(shown) {
  const age = byId("what").value === "age", canvas = byId("matrix"), cells = new Map();
  shown.forEach((count) => {
    const [, sender, receiver] = RUN.links[count.place], key = `${sender} ${receiver}`, cell = cells.get(key) || {sender, receiver, fates: {}, newest_ns: -1};
    Object.entries(count.fates).forEach(([fate, copies]) => { cell.fates[fate] = (cell.fates[fate] || 0) + copies; });
    cell.newest_ns = Math.max(cell.newest_ns, count.newest_ns);
    cells.set(key, cell);
  });
  const order = RUN.scene.nodes.map((node) => node.name), used = (side) => {
    const there = new Set([...cells.values()].map((cell) => cell[side]));
    return [...order.filter((name) => there.delete(name)), ...there];
  };
  const senders = used("sender"), receivers = used("receiver");
  const size = Math.max(11, Math.min(24, Math.floor((canvas.parentElement.clientWidth - 130) / receivers.length)));
  const pen0 = canvas.getContext("2d");
  pen0.font = "11px system-ui, sans-serif";
  const side = Math.min(120, Math.max(...[...senders, ...receivers].map((name) => pen0.measureText(name).width)) + 10);
  const width = side + receivers.length * size + 8, height = side + senders.length * size + 4;
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  const pen = clearCanvas(canvas, width, height), good = fateColour("delivered"), bad = pick(RUN.scene.palette.violated);
  const low = pick(RUN.scene.palette.low), high = pick(RUN.scene.palette.high);
  const oldest = Math.log1p(Math.max(1e6, ...[...cells.values()].map(ageOf)) / 1e6);
  pen.font = "11px system-ui, sans-serif";
  pen.fillStyle = css("--soft");
  pen.textBaseline = "middle";
  pen.textAlign = "right";
  senders.forEach((name, row) => pen.fillText(name, side - 6, side + (row + 0.5) * size, side - 6));
  receivers.forEach((name, column) => {
    pen.save();
    pen.translate(side + (column + 0.5) * size, side - 6);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "left";
    pen.fillText(name, 0, 0, side - 6);
    pen.restore();
  });
  pen.textAlign = "left";
  LINKS.cells = [];
  cells.forEach((cell) => {
    const total = meantOf(cell.fates), x = side + receivers.indexOf(cell.receiver) * size, y = side + senders.indexOf(cell.sender) * size;
    pen.fillStyle = age ? cell.newest_ns < 0 ? css("--line") : mix(low, high, Math.min(1, Math.log1p(ageOf(cell) / 1e6) / oldest))
      : total ? mix(bad, good, arrivedOf(cell.fates) / total) : css("--line");
    pen.fillRect(x, y, size - 1, size - 1);
    LINKS.cells.push({x, y, size, cell});
  });
}

byId("matrix").addEventListener("mousemove", (event) => {
  const at = LINKS.cells.find(({x, y, size}) => event.offsetX >= x && event.offsetX < x + size && event.offsetY >= y && event.offsetY < y + size);
  LINKS.told = at ? `${at.cell.sender} → ${at.cell.receiver}: ${Object.entries(at.cell.fates).map(([fate, copies]) => `${copies} ${fate}`).join(", ")}; `
    + `age of information ${span(ageOf(at.cell))}` : "";
  drawLinks();
});
["medium", "what"].forEach((id) => byId(id).addEventListener("change", () => { LINKS.told = ""; drawLinks(); }));
