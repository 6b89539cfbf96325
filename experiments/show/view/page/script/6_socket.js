// The connection to the run: updates come in, commands go out, each with its answer.
const AGAIN_MS = 1000, MOST_TRIES = 5;
let tries = 0, first = true;

function command(asked) {
  return new Promise((done) => {
    if (!RUN.socket) return done({error: "The page is not connected to the run.", fields: {}});
    const request = ++FORM.request;
    FORM.waiting.set(request, done);
    RUN.socket.send(JSON.stringify({type: "command", client: 0, request, ...asked}));
  });
}

function take(message) {
  switch (message.type) {
    case "scene":
      RUN.scene = message.scene;
      Object.assign(RUN, {links: [], counts: [], at: {}, away: {}, now_ns: 0, ended: null});
      first = true;
      byId("events").tBodies[0].replaceChildren();
      rowsOfKind.clear();
      byId("name").textContent = document.title = RUN.scene.name;
      document.title = `${RUN.scene.name}: live view`;
      byId("question").textContent = byId("question").title = RUN.scene.question;
      notice("");
      startMap();
      startLinks();
      startFaults();
      addEvents([]);
      drawHead();
      break;
    case "update": {
      const before = new Map(message.changed.map(([place]) => [place, RUN.counts[place] ? RUN.counts[place].fates : undefined]));
      RUN.links.push(...message.links);
      const changed = message.changed.map(([place, newest_ns, fates]) => RUN.counts[place] = {place, newest_ns, fates});
      Object.assign(RUN.at, message.at);
      Object.assign(RUN, {now_ns: message.now_ns, speed: message.speed, paused: message.paused, wanted: message.wanted, away: message.away,
                          lateness: message.lateness, eventsTotal: message.events_total, told: RUN.told + 1});
      noteOnMap(changed, message.at, before, first);
      first = false;
      if (message.events.length) addEvents(message.events);
      drawHead();
      drawLinks();
      drawLateness();
      break;
    }
    case "answer": {
      const done = FORM.waiting.get(message.request);
      FORM.waiting.delete(message.request);
      if (done) done(message);
      if (message.error && !done) notice(message.error, "fails");
      break;
    }
    case "end":
      RUN.ended = message;
      notice([`The run has ended: ${message.words}`, ...message.problems, ...(message.folder ? [`records: ${message.folder}`] : []),
              ...(message.report ? [`report: ${message.report}`] : [])].join("\n"),
             message.holds ? "holds" : "fails");
      if (RUN.scene) { drawHead(); showQuick(); }
      break;
  }
}

function connect() {
  const socket = new WebSocket(`${location.protocol.replace("http", "ws")}//${location.host}/live${location.search}`);
  socket.addEventListener("open", () => { tries = 0; RUN.socket = socket; });
  socket.addEventListener("message", (event) => take(JSON.parse(event.data)));
  socket.addEventListener("close", () => {
    RUN.socket = null;
    FORM.waiting.forEach((done) => done({error: "The connection to the run was lost.", fields: {}}));
    FORM.waiting.clear();
    if (RUN.scene) drawHead();
    if (RUN.ended) return;
    if (++tries > MOST_TRIES) {
      byId("state").textContent = "gone";
      byId("state").className = "badge fails";
      return notice("The run cannot be reached any more: it has ended, or the address is an old one.", "fails");
    }
    notice("The connection to the run was lost; the page connects again.");
    setTimeout(connect, AGAIN_MS);
  });
}

connect();
