// The form that injects faults: its kinds and fields are those of [[faults]]; what the loader refuses is told at its field.
const FORM = {waiting: new Map(), request: 0};

function startFaults() {
  const kinds = RUN.scene.faults, list = byId("kind");
  list.replaceChildren(...["nodes", "links", "media"].filter((on) => kinds.some((kind) => kind.on === on)).map((on) => {
    const group = Object.assign(document.createElement("optgroup"), {label: `of ${on}`});
    group.append(...kinds.filter((kind) => kind.on === on).map((kind) => Object.assign(element("option", kind.kind), {value: kind.kind})));
    return group;
  }));
  list.disabled = byId("inject").disabled = !kinds.length;
  if (kinds.length) showFields();
  else byId("about").textContent = "Nothing in this scenario can take a fault.";
  showQuick();
}

const kindShown = () => RUN.scene.faults.find((kind) => kind.kind === byId("kind").value);

function showFields() {
  const kind = kindShown();
  byId("about").textContent = kind.about;
  const on = {key: "on", unit: "", required: true, default: "", options: [], example: "", targets: kind.targets};
  byId("fields").replaceChildren(...[on, ...kind.fields].map(fieldOf));
  if (RUN.chosen && kind.on === "nodes") byId("fields").querySelector("[name=on]").value = RUN.chosen;
  say("");
}

function fieldOf(field) {
  const label = element("label", "", "field"), input = document.createElement(field.options.length ? "select" : "input");
  label.append(element("span", field.key, field.required ? "needed" : ""), input);
  input.name = field.key;
  if (field.options.length) {
    if (!field.required) input.append(Object.assign(element("option", field.default ? `${field.default} (unless chosen)` : ""), {value: ""}));
    input.append(...field.options.map((word) => Object.assign(element("option", word), {value: word})));
  } else input.placeholder = field.default || (field.example && `as ${field.example}`) || (field.key === "lasts_s" ? "to the end of the run" : "");
  if (field.targets) {
    const list = Object.assign(document.createElement("datalist"), {id: "targets"});
    list.append(...field.targets.map((name) => Object.assign(document.createElement("option"), {value: name})));
    input.setAttribute("list", "targets");
    input.placeholder = field.targets[0];
    label.append(list);
  }
  return label;
}

// Buttons for faults of the chosen node that need no more than an end.
function showQuick() {
  const quick = byId("quick"), kinds = RUN.scene.faults.filter((kind) => kind.on === "nodes" && kind.targets.includes(RUN.chosen)
    && kind.fields.every((field) => !field.required));
  byId("chosen").textContent = RUN.ended ? "The run has ended: it takes no more faults." : RUN.chosen ? `On ${RUN.chosen}:` : "Click a robot on the map to choose it.";
  if (!RUN.chosen || RUN.ended) return quick.replaceChildren();
  const lasts = Object.assign(element("input"), {value: "1", id: "quick-lasts"});
  lasts.setAttribute("aria-label", "seconds that it lasts");
  const button = (kind) => {
    const made = Object.assign(element("button", kind.kind.replaceAll("_", " ")), {type: "button", title: kind.about});
    made.dataset.kind = kind.kind;
    made.addEventListener("click", () => inject(kind.kind, {on: RUN.chosen, ...(kind.lasting ? {lasts_s: lasts.value} : {})}));
    return made;
  };
  const lasting = kinds.filter((kind) => kind.lasting);
  quick.replaceChildren(...kinds.filter((kind) => !kind.lasting).map(button), ...lasting.map(button),
    ...(lasting.length ? [element("span", "for", "soft"), lasts, element("span", "s", "soft")] : []));
}

function choose(name) {
  RUN.chosen = name;
  if (kindShown() && kindShown().on === "nodes") byId("fields").querySelector("[name=on]").value = name;
  showQuick();
  drawMapSoon();
}

function say(words, holds = true, fields = {}) {
  byId("told").textContent = words;
  byId("told").className = words ? holds ? "holds" : "fails" : "";
  byId("fields").querySelectorAll("em").forEach((old) => old.remove());
  byId("fields").querySelectorAll("[aria-invalid]").forEach((input) => input.removeAttribute("aria-invalid"));
  Object.entries(fields).forEach(([key, text]) => {
    const input = byId("fields").querySelector(`[name="${CSS.escape(key)}"]`);
    if (!input) return;
    input.setAttribute("aria-invalid", "true");
    input.parentElement.append(element("em", text));
  });
}

async function inject(kind, keys) {
  const answer = await command({what: "fault", kind, keys});
  if (!answer.error) return say(answer.told);
  const shown = byId("kind").value === kind ? answer.fields : {};
  const left = answer.error.split("\n").map((line) => line.replace(/^fault: /, ""))
    .filter((line) => !Object.entries(shown).some(([key, text]) => text === line && byId("fields").querySelector(`[name="${CSS.escape(key)}"]`)));
  say(left.length ? left.join("\n") : "The fields that are marked have to be changed.", false, shown);
}

byId("kind").addEventListener("change", showFields);
byId("fault").addEventListener("submit", (event) => {
  event.preventDefault();
  const keys = {};
  byId("fields").querySelectorAll("[name]").forEach((input) => { if (input.value.trim() !== "") keys[input.name] = input.value.trim(); });
  inject(byId("kind").value, keys);
});
