// Controls, the first drawing, and which section of the contents is in view.
const drawers = [];
const drawing = (id, draw) => byId(id) && drawers.push(draw);

if (byId("signal")) {
  DATA.signals.forEach((entry, k) => byId("signal").add(new Option(named(entry.name, entry.unit), k)));
  byId("signal").onchange = byId("marks").onchange = drawSignal;
  byId("signal-whole").onclick = () => { signalRange = null; drawSignal(); };
}
if (byId("interval")) {
  DATA.gaps.forEach((gap, k) => byId("interval").add(new Option(`${gap.sender} on ${gap.medium}`, k)));
  byId("interval").onchange = drawIntervals;
}
if (byId("slot-from")) {
  const shift = (sign) => () => {
    byId("slot-from").value = Math.max(0, Number(byId("slot-from").value) + sign * Number(byId("slot-width").value));
    drawSlots();
  };
  byId("slot-from").onchange = byId("slot-width").onchange = drawSlots;
  byId("slot-back").onclick = shift(-1);
  byId("slot-on").onclick = shift(1);
  const instants = [...new Set(Object.values(DATA.switching.media).flat())].filter((t) => t <= DATA.spoken.until_s).slice(0, 500);
  byId("slot-switch").add(new Option(instants.length ? "choose" : "none", ""));
  instants.forEach((t) => byId("slot-switch").add(new Option(seconds(t), t)));
  byId("slot-switch").onchange = () => {
    if (byId("slot-switch").value === "") return;
    byId("slot-from").value = Math.max(0, byId("slot-switch").value * 1e3 - Number(byId("slot-width").value) / 2);
    drawSlots();
  };
}
if (byId("plane-at")) {
  byId("plane-at").oninput = drawPlane;
  byId("plane-play").onclick = playPlane;
  if (byId("plane-before")) {
    byId("plane-before").onclick = () => nextTold(-1);
    byId("plane-after").onclick = () => nextTold(1);
  }
}
drawing("plot-signal", drawSignal);
drawing("plot-plane", drawPlane);
drawing("plot-modes", drawModes);
drawing("plot-slots", drawSlots);
drawing("plot-fates", drawFates);
drawing("plot-ages", drawAges);
drawing("plot-gaps", drawGaps);
drawing("plot-intervals", drawIntervals);
drawing("plot-lateness", drawLateness);
DATA.charts.forEach((chart, k) => drawing(`plot-chart-${k}`, () => Plotly.react(`plot-chart-${k}`, heights(chart),
  heightsLayout(chart), config())));

document.addEventListener("click", (event) => {
  const button = event.target.closest("[data-t]");
  if (button && typeof Plotly !== "undefined") {
    const first = ["plane", "signals", "spoken"].find((id) => byId(id));
    showInstant(Number(button.dataset.t), button.dataset.words, button.dataset.to || first);
  }
});
document.querySelectorAll("details.frames").forEach((details) => details.addEventListener("toggle", () => listFrames(details)));
byId("instant-before").onclick = () => nextMoment(-1);
byId("instant-after").onclick = () => nextMoment(1);
byId("instant-before").hidden = byId("instant-after").hidden = DATA.moments.length < 2;
byId("instant-close").onclick = forgetInstant;

const contents = new Map([...document.querySelectorAll("#contents a")].map((link) => [link.hash.slice(1), link]));
const seen = new Set();
const watcher = new IntersectionObserver((entries) => {
  entries.forEach((entry) => entry.isIntersecting ? seen.add(entry.target.id) : seen.delete(entry.target.id));
  const current = [...contents.keys()].find((id) => seen.has(id));
  contents.forEach((link, id) => link.classList.toggle("current", id === current));
}, {rootMargin: "-20% 0px -60% 0px"});
contents.forEach((_, id) => byId(id) && watcher.observe(byId(id)));

if (typeof Plotly === "undefined") {
  document.querySelectorAll(".plot").forEach((place) => {
    place.className = "empty";
    place.textContent = "This chart cannot be drawn: " + document.body.dataset.plotly;
  });
} else {
  const redraw = () => drawers.forEach((draw) => draw());
  redraw();
  if (byId("plot-signal")) {
    byId("plot-signal").on("plotly_click", (event) => showInstant(event.points[0].x, "chosen in the chart of signals"));
  }
  if (byId("plot-modes")) {
    byId("plot-modes").on("plotly_click", (event) => showInstant(event.points[0].customdata, "chosen in the modes over time"));
  }
  dark.addEventListener("change", redraw);
  narrow.addEventListener("change", redraw);
}
