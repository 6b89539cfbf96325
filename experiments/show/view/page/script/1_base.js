"use strict";
// What the run has told so far. Times are virtual, in nanoseconds; positions in metres.
const RUN = {scene: null, now_ns: 0, links: [], counts: [], at: {}, away: {}, events: [], eventsTotal: 0, paused: false, wanted: null, speed: 0,
             lateness: null, ended: null, chosen: null, told: 0};
const MOST_OF_A_KIND = 30, MOST_LINKS_IN_TABLE = 30;
const LEVELS = {1: "debug", 2: "info", 3: "warning", 4: "error", 5: "fatal"};

const byId = (id) => document.getElementById(id);
const dark = () => matchMedia("(prefers-color-scheme: dark)").matches;
const pick = (pair) => pair[dark() ? 1 : 0];
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const fateColour = (fate) => pick(RUN.scene.palette.fates[fate] || RUN.scene.palette.fates.unfinished);
const nodeColour = (index) => pick(RUN.scene.palette.curves[index % RUN.scene.palette.curves.length]);

function element(tag, text = "", kind = "") {
  const made = document.createElement(tag);
  if (text !== "") made.textContent = text;
  if (kind) made.className = kind;
  return made;
}

const seconds = (ns, digits = 3) => `${(ns / 1e9).toFixed(digits)} s`;

// A length of time with three digits that count: 0.42 ms, 12.3 ms, 1.25 s.
function span(ns) {
  if (ns < 0) return "never";
  if (ns < 1e9) return `${(ns / 1e6).toPrecision(3)} ms`;
  return ns < 1e11 ? `${(ns / 1e9).toPrecision(3)} s` : `${Math.round(ns / 1e9)} s`;
}

const sum = (values) => Object.values(values).reduce((total, value) => total + value, 0);
const arrived = (fate) => RUN.scene.arrived.includes(fate), unseen = (fate) => RUN.scene.unseen.includes(fate);
// Of the copies that were to arrive: looks at which there was nothing to be seen are none of them.
const arrivedOf = (fates) => sum(Object.fromEntries(Object.entries(fates).filter(([fate]) => arrived(fate))));
const meantOf = (fates) => sum(Object.fromEntries(Object.entries(fates).filter(([fate]) => !unseen(fate))));
const ageOf = (count) => count.newest_ns < 0 ? -1 : Math.max(0, RUN.now_ns - count.newest_ns);

// A canvas of this size in CSS pixels, sharp on every screen, cleared.
function clearCanvas(canvas, width, height) {
  const scale = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  return pen;
}
