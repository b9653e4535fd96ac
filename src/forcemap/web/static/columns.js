// How a device writes its files: a file is dropped, its columns are clicked, it is judged by them, and they are written.
import { curve } from "./curve.js";
import { GONE } from "./live.js";
import { waited, waitingFor } from "./wait.js";
import { dropZone } from "./zone.js";

const form = document.getElementById("map");
const [zone, chosen, table, judged, chartOf, place, said, save, confirm, choices] = ["zone", "file", "table", "judged", "curve-of", "curve", "said", "save", "confirm", "choices"].map((id) => document.getElementById(id));
let [file, columns, roles, request] = [null, null, {}, 0];

function say(words, className = "problem") {
  said.replaceChildren(...(words ? [Object.assign(document.createElement("p"), { className, textContent: words })] : []));
}

async function post(way, body, type, query = "") {
  const response = await waited(fetch(`${form.dataset.api}/${way}${query}`, { method: "POST", headers: { "content-type": type }, body })).catch(() => null);
  const answer = await response?.json().catch(() => null);
  return response?.ok ? { answer } : { problem: answer?.error ? [answer.error.column, answer.error.message].filter(Boolean).join(": ") : GONE };
}

// the entries of [recordings] that the clicks and choices say
function stated() {
  const of = (role) => Object.keys(roles).filter((number) => roles[number] === role).map((number) => name(Number(number)));
  const [times, forces] = [of("time"), of("force")];
  const { time_unit, force_unit, sign, newtons_per_count, sampling_rate_Hz } = Object.fromEntries(new FormData(choices));
  return {
    ...(times.length ? { time: times[0], time_unit } : sampling_rate_Hz ? { sampling_rate_Hz: Number(sampling_rate_Hz) } : {}),
    ...(forces.length ? { force: forces.length === 1 ? forces[0] : forces } : {}),
    force_unit, sign: Number(sign),
    ...(force_unit === "counts" && newtons_per_count ? { newtons_per_count: Number(newtons_per_count) } : {}),
  };
}

function name(number) {
  const called = columns.names[number];
  return /^\d+$/.test(called) ? Number(called) : called;
}

async function take(next) {
  if (!next) return;
  file = next;
  const own = ++request;
  say("");
  confirm.hidden = true;
  table.replaceChildren(waitingFor(`Reading ${file.name}`));
  const { answer, problem } = await post("columns", file, "application/octet-stream", `?${new URLSearchParams({ file: file.name })}`);
  if (own !== request) return;
  [columns, roles] = [answer ?? null, {}];
  choices.hidden = !columns;
  if (!columns) table.replaceChildren(Object.assign(document.createElement("p"), { className: "problem", textContent: problem }));
  if (!columns) return;
  const states = (role, unit) => [...choices.elements[`${role}_unit`].options].some((option) => option.value === unit);
  columns.units.forEach((unit, number) => {
    const role = ["time", "force"].find((each) => states(each, unit));
    if (!role || Object.values(roles).includes(role)) return;
    roles[number] = role;
    choices.elements[`${role}_unit`].value = unit;
  });
  show();
  judge();
}

function show() {
  const drawn = Object.assign(document.createElement("table"), {});
  const head = drawn.createTHead().insertRow();
  columns.names.forEach((called, number) => {
    const cell = Object.assign(document.createElement("th"), { scope: "col" });
    const button = Object.assign(document.createElement("button"), { type: "button", className: "plain" });
    const role = roles[number] ?? "";
    button.append(called, Object.assign(document.createElement("small"), { textContent: role || "not read" }));
    button.setAttribute("aria-label", `Column ${called}: ${role || "not read"}; click for time, force, not read`);
    button.addEventListener("click", () => click(number));
    cell.className = role ? "chosen" : "";
    cell.append(button);
    head.append(cell);
  });
  const body = drawn.createTBody();
  for (const line of columns.lines) {
    const row = body.insertRow();
    line.cells.forEach((text, number) => {
      const cell = row.insertCell();
      cell.textContent = text;
      cell.className = `${line.numbers ? "n" : ""} ${roles[number] ? "chosen" : ""}`.trim();
    });
  }
  const caption = drawn.createCaption();
  caption.textContent = `${columns.file}, columns separated by ${columns.delimiter || "nothing"}: click a head until it says what the column is${columns.left_off ? `; ${columns.left_off} columns more` : ""}`;
  const wide = Object.assign(document.createElement("div"), { className: "wide columns", tabIndex: 0 });
  wide.setAttribute("role", "region");
  wide.setAttribute("aria-label", "Columns of the file");
  wide.append(drawn);
  const focused = [...table.querySelectorAll("th button")].indexOf(document.activeElement);
  table.replaceChildren(wide);
  if (focused >= 0) table.querySelectorAll("th button")[focused].focus();
}

function click(number) {
  const taken = Object.keys(roles).some((other) => roles[other] === "time" && Number(other) !== number);
  const order = taken ? ["", "force"] : ["", "time", "force"]; // there is one time
  const next = order[(order.indexOf(roles[number] ?? "") + 1) % order.length];
  if (next) roles[number] = next;
  else delete roles[number];
  show();
  judge();
}

async function judge() {
  const own = ++request;
  confirm.hidden = true;
  save.disabled = true;
  chartOf.hidden = true;
  const wanted = stated();
  const lacks = [["a force", wanted.force], ["a time, or samples per second", wanted.time ?? wanted.sampling_rate_Hz]].filter(([, value]) => value === undefined);
  if (lacks.length) {
    judged.replaceChildren(Object.assign(document.createElement("p"), { textContent: `Still missing: ${lacks.map(([words]) => words).join(", and ")}. Click the head of its column.` }));
    return;
  }
  judged.replaceChildren(waitingFor(`Reading ${file.name} by these columns`));
  const query = new URLSearchParams({ file: file.name, curves: "true", columns: JSON.stringify(wanted) });
  const { answer, problem } = await post("judge", file, "application/octet-stream", `?${query}`);
  if (own !== request) return;
  if (problem || answer.kind === "table") {
    judged.replaceChildren(Object.assign(document.createElement("p"), { className: "problem", textContent: problem ?? "This is an impacts table, no recording" }));
    return;
  }
  const [first] = answer.impacts;
  const words = first ? `${answer.impacts.length} impact${answer.impacts.length === 1 ? "" : "s"}, Phase I peak ${first.peak_force_N.toFixed(1)} N, ${first.scenario_words}` : (answer.reason ?? "no impact was found");
  judged.replaceChildren(Object.assign(document.createElement("p"), { textContent: `Read by these columns: ${words}. Does the curve look like your impact?` }));
  chartOf.hidden = false;
  curve(place, answer);
  save.disabled = false;
}

async function write(confirmed) {
  const body = JSON.stringify({ columns: stated(), looked_at: form.dataset.lookedAt, confirmed });
  const { answer, problem } = await post("conditions/recordings", body, "application/json");
  if (problem) say(`${problem}. Nothing was written.`);
  else if (!answer.written) {
    say(`This would no longer fit the recordings: ${answer.binding}. Nothing was written yet.`);
    confirm.hidden = false;
    confirm.focus();
  } else {
    form.dataset.lookedAt = answer.looked_at;
    confirm.hidden = true;
    if (answer.binding) say(`Written. ${answer.binding}`);
    else say("Written to [recordings] of campaign.toml", "note");
  }
}

chosen.addEventListener("change", () => take(chosen.files[0]));
dropZone(zone, (files) => take(files[0]));
choices.addEventListener("input", () => columns && judge());
choices.addEventListener("submit", (event) => {
  event.preventDefault();
  write(false);
});
confirm.addEventListener("click", () => write(true));
