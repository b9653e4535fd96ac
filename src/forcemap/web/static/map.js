// The map page: the bound over all places and slices through the state that the sliders name; the workspace comes last.
import { chart } from "./chart.js";
import { data, live, ofThisMap } from "./live.js";
import { colourBar, onThemeChange } from "./look.js";
import { plane } from "./plane.js";
import { tables } from "./tables.js";
import { waited, waitingFor } from "./wait.js";
import { block } from "./workspace.js";

const SLICES = { along_distance: ["Distance [m]", "distance_m"], along_height: ["Height [m]", "height_m"], along_speed: ["Speed [m/s]", "speed_mps"] };
const form = document.querySelector("form[data-live]");
const [canvas, element, forces] = ["workspace", "plane", "forces"].map((id) => document.getElementById(id));
const fields = Object.fromEntries(["distance_m", "height_m", "speed_mps"].map((name) => [name, form.elements[name]]));
const axes = Object.fromEntries(Object.keys(fields).map((name) => {
  const range = form.querySelector(`[data-for=${name}]`);
  return [name, [Number(range.min), Number(range.max)]];
}));
const states = data("map-data").measured_states;
const charts = Object.fromEntries(Object.keys(SLICES).map((id) => [id, chart(document.getElementById(id))]));
const drawn = plane(element, axes, ([[d, h]]) => set({ distance_m: d, height_m: h }), say);
let [workspace, answer] = [null, null];

function chosenState() {
  return Object.fromEntries(Object.entries(fields).map(([name, field]) => [name, Number(field.value)]));
}

function set(values) {
  for (const [name, value] of Object.entries(values)) fields[name].value = value;
  for (const name of Object.keys(values)) fields[name].dispatchEvent(new Event("input", { bubbles: true }));
}

function say(i, j) {
  const bound = i >= 0 && j >= 0 ? answer.place_bound_N[i][j] : null;
  return bound === null ? "outside what was measured" : `bound about ${bound.toFixed(1)} N`;
}

function lines(state) {
  const limit = answer.speed.limit_N;
  for (const [id, [title, name]] of Object.entries(SLICES)) {
    const line = answer[id];
    charts[id]({
      x: title, y: "Force [N]", digits: [3, 1],
      lines: [{ x: line.at, y: line.predicted_N, name: "predicted", look: "model" }, { x: line.at, y: line.bound_N, name: "bound", look: "bound" }],
      levels: limit === null ? [] : [{ y: limit, name: `limit ${limit.toFixed(0)} N`, look: "limit" }],
      spots: answer.bound_N === null ? [] : [{ x: state[name], y: answer.bound_N, name: "here", look: "spot" }],
    });
  }
}

function overPlaces(state) {
  const { distance_m, height_m, place_bound_N: values, contours } = answer;
  const known = values.flat().filter((value) => value !== null);
  const range = [Math.min(...known), Math.max(...known)];
  const measured = states.filter((each) => each.force_N !== null).map((each) => [each.distance_m, each.height_m]);
  drawn.show({ distance_m, height_m, values, range, contours, limit: answer.speed.limit_N, measured, outcome: (i, j) => (values[i][j] === null ? "outside" : "admissible") });
  drawn.point([[state.distance_m, state.height_m]]);
  const bar = document.createElement("span");
  bar.append(...(known.length ? colourBar(`bound ${range[0].toFixed(0)}`, `${range[1].toFixed(0)} N`) : ["nothing was measured at this speed"]));
  document.getElementById("bounds").replaceChildren(bar);
}

function draw(answers) {
  for (const part of [element, canvas, ...document.querySelectorAll(".charts .chart")]) part.classList.toggle("stale", !answers);
  if (!answers) return;
  answer = data("answer-data");
  const state = chosenState();
  workspace?.show(Object.values(state));
  overPlaces(state);
  lines(state);
}

// the workspace is 10^5 points: they are asked for when everything else is there, and the place for it is seen
async function fill() {
  forces.replaceChildren(waitingFor("The workspace is coming"));
  const response = await waited(fetch(canvas.dataset.workspace)).catch(() => null);
  if (!response?.ok) {
    forces.replaceChildren(Object.assign(document.createElement("p"), { className: "problem", textContent: "No workspace: there was no answer." }));
    return;
  }
  const cube = await response.json();
  if (!ofThisMap(`${cube.map_sha256} ${cube.limits_sha256}`)) return;
  workspace = block(canvas, cube, states);
  workspace.show(Object.values(chosenState()));
  forces.replaceChildren(...colourBar(...workspace.range.map((force) => `${force.toFixed(0)} N`)));
}

live(draw);
onThemeChange(() => workspace?.draw());
new IntersectionObserver((seen, watching) => {
  if (!seen.some((each) => each.isIntersecting)) return;
  watching.disconnect();
  requestAnimationFrame(() => setTimeout(fill));
}).observe(canvas);
tables(document);
