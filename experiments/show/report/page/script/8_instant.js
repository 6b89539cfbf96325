// One instant of the run, chosen by a click: signals, animation and slot chart all show it.
let cursor_s = null;
let step = -1;              // place among DATA.moments, -1: the instant is none of them

// A line at the chosen instant for a chart whose x axis counts `scale` to the second.
function cursorLine(scale) {
  return cursor_s === null ? [] : [{type: "line", x0: cursor_s * scale, x1: cursor_s * scale, y0: 0, y1: 1, yref: "paper",
                                    line: {color: css("--ink"), width: 1.6, dash: "dash"}}];
}

function showInstant(t_s, words, goTo) {
  cursor_s = t_s;
  if (byId("signal")) {
    const half = Math.max(DATA.length_s / 20, 1e-9);
    signalRange = [Math.max(0, t_s - half), Math.min(DATA.length_s, Math.max(0, t_s - half) + 2 * half)];
    drawSignal();
  }
  if (byId("plane-at")) {
    const instants = DATA.plane.instants_s, k = Math.min(instants.length - 1, firstFrom(instants, t_s - 1e-9));
    stopPlane();
    byId("plane-at").value = k > 0 && t_s - instants[k - 1] < instants[k] - t_s ? k - 1 : k;
    drawPlane();
  }
  if (byId("slot-from")) {
    byId("slot-from").value = +Math.max(0, t_s * 1e3 - Number(byId("slot-width").value) / 2).toFixed(6);
    drawSlots();
  }
  if (byId("interval")) drawIntervals();
  if (byId("plot-modes")) drawModes();
  byId("instant-time").textContent = seconds(t_s);
  byId("instant-words").textContent = words || "";
  byId("instant").hidden = false;
  document.querySelectorAll("[data-t].chosen").forEach((button) => button.classList.remove("chosen"));
  document.querySelectorAll("[data-t]").forEach((button) => button.classList.toggle("chosen", Number(button.dataset.t) === t_s));
  if (goTo && byId(goTo)) byId(goTo).scrollIntoView({behavior: "smooth", block: "start"});
}

function forgetInstant() {
  cursor_s = null;
  signalRange = null;
  byId("instant").hidden = true;
  document.querySelectorAll("[data-t].chosen").forEach((button) => button.classList.remove("chosen"));
  [["signal", drawSignal], ["slot-from", drawSlots], ["interval", drawIntervals], ["plot-modes", drawModes]].forEach(([id, draw]) => byId(id) && draw());
}

// To the next moment (sign 1) or the one before (-1) that has an instant.
function nextMoment(sign) {
  const all = DATA.moments;
  if (!all.length) return;
  let k = firstFrom(all.map((moment) => moment.t_s), cursor_s === null ? 0 : cursor_s);
  if (step >= 0 && all[step].t_s === cursor_s) k = step + sign;
  else if (sign < 0) k -= 1;
  step = (k + all.length) % all.length;
  showInstant(all[step].t_s, all[step].words);
}

// Which frames a cause speaks of, each with its instant, as far as the page holds them.
let rowOfFrame = null;
function listFrames(details) {
  const target = details.querySelector("ul");
  if (!details.open || target.childElementCount) return;
  const s = DATA.spoken;
  if (rowOfFrame === null) {
    rowOfFrame = new Map();
    for (let k = 0; k < s.rows; k++) {
      rowOfFrame.set(`${s.medium.names[s.medium.codes[k]]}|${s.sender.names[s.sender.codes[k]]}|${s.number[k]}`, k);
    }
  }
  details.dataset.numbers.split(",").forEach((number) => {
    const item = document.createElement("li"), k = rowOfFrame.get(`${details.dataset.medium}|${details.dataset.sender}|${number}`);
    item.textContent = `frame ${number}`;
    if (k !== undefined) {
      const t_s = +(s.start_ms[k] / 1e3).toFixed(9), button = document.createElement("button");
      button.type = "button";
      button.className = "at";
      button.dataset.t = t_s;
      button.dataset.to = "spoken";
      button.dataset.words = `frame ${number} of ${details.dataset.sender} on ${details.dataset.medium}`;
      button.textContent = seconds(t_s);
      item.append(" at ", button);
    }
    target.append(item);
  });
  if (Number(details.dataset.more)) {
    const item = document.createElement("li");
    item.textContent = `and ${details.dataset.more} more`;
    target.append(item);
  }
}
