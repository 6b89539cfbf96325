// Time, speed, events and lateness; the buttons for pause and speed.
function drawHead() {
  const scene = RUN.scene, state = byId("state");
  byId("time").textContent = seconds(RUN.now_ns);
  byId("length").textContent = `of ${+(scene.end_ns / 1e9).toPrecision(6)} s`;
  byId("progress").value = Math.min(1, RUN.now_ns / scene.end_ns);
  const words = RUN.ended ? "ended" : RUN.paused ? "paused" : "runs";
  state.textContent = words;
  state.className = `badge ${words === "ended" ? RUN.ended.holds ? "runs" : "fails" : words}`;
  byId("pace").textContent = RUN.ended ? "" : scene.real_time ? "in real time" : RUN.paused ? "virtual time stands still"
    : `${RUN.speed >= 100 ? Math.round(RUN.speed) : RUN.speed.toPrecision(2)} × real time`;
  byId("pause").textContent = RUN.paused ? "Go on" : "Pause";
  const fixed = scene.real_time || Boolean(RUN.ended) || !RUN.socket;
  byId("pause").disabled = fixed;
  byId("controls").title = scene.real_time ? "A run in real time follows the wall clock." : "";
  byId("speeds").querySelectorAll("button").forEach((button) => {
    button.disabled = fixed;
    button.setAttribute("aria-pressed", String(!scene.real_time && (RUN.wanted === null ? button.dataset.speed === "" : Number(button.dataset.speed) === RUN.wanted)));
  });
  const takesNone = Boolean(RUN.ended) || !RUN.socket || !scene.faults.length;
  [...byId("fault").elements].forEach((part) => { part.disabled = takesNone; });
}

function whatOf(kind, detail) {
  const cell = element("td");
  cell.append(element("b", kind), detail ? ` ${detail}` : "");
  return cell;
}

// A frequent kind does not push a rare one out.
const rowsOfKind = new Map();

function addEvents(events) {
  const body = byId("events").tBodies[0];
  events.forEach(([time_ns, node, kind, detail, level]) => {
    const row = element("tr", "", LEVELS[level] || "");
    row.append(element("td", seconds(time_ns), "n"), element("td", node, "name"), whatOf(kind, detail));
    body.prepend(row);
    const same = rowsOfKind.get(kind) || rowsOfKind.set(kind, []).get(kind);
    same.push(row);
    if (same.length > MOST_OF_A_KIND) same.shift().remove();
  });
  const shown = body.rows.length, total = RUN.eventsTotal;
  byId("event-count").textContent = total > shown ? `${shown} of ${total.toLocaleString("en")}: the latest of each kind` : total || "none yet";
}

function drawLateness() {
  const late = RUN.lateness;
  byId("lateness-card").hidden = !late;
  if (!late) return;
  const lines = [["instants", late.instants.toLocaleString("en")], ["median", span(late.median_ns)], ["99 %", span(late.p99_ns)],
                 ["worst", span(late.worst_ns)], ["overruns", late.overruns]];
  byId("lateness").replaceChildren(...lines.flatMap(([name, value]) => [element("dt", name), element("dd", String(value))]));
}

function notice(words, kind = "") {
  byId("notice").hidden = !words;
  byId("notice").textContent = words;
  byId("notice").className = kind;
}

byId("pause").addEventListener("click", () => command({what: RUN.paused ? "go" : "pause"}));
byId("speeds").addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (button) command({what: "speed", speed: button.dataset.speed === "" ? null : Number(button.dataset.speed)});
});
