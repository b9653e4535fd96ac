// The map page: the workspace turned by hand, and slices through the state that the sliders name.
import { data, live, ofThisMap } from "./live.js";
import { COLOURS, CONFIG, SCALE, colourBar, layout, onThemeChange } from "./look.js";
import { plotly } from "./plotly.js";
import { block } from "./workspace.js";

const AXES = { along_distance: ["Distance [m]", "distance_m"], along_height: ["Height [m]", "height_m"], along_speed: ["Speed [m/s]", "speed_mps"] };
const HERE = { color: COLOURS.here, symbol: "diamond" };
const canvas = document.getElementById("workspace");
let workspace = null;

function chosenState() {
  const form = new FormData(document.querySelector("form[data-live]"));
  return Object.fromEntries(["distance_m", "height_m", "speed_mps"].map((name) => [name, Number(form.get(name))]));
}

function lines(Plotly, answer, state) {
  const limit = answer.speed.limit_N;
  for (const [id, [title, name]] of Object.entries(AXES)) {
    const line = answer[id];
    const traces = [
      { x: line.at, y: line.predicted_N, name: "predicted", line: { color: COLOURS.predicted, width: 2 } },
      { x: line.at, y: line.bound_N, name: "bound", line: { dash: "dash", width: 1.5, color: layout().font.color } },
      { x: [state[name]], y: [answer.bound_N], name: "here", mode: "markers", marker: { ...HERE, size: 10 } },
    ];
    if (limit !== null)
      traces.push({ x: [line.at[0], line.at.at(-1)], y: [limit, limit], name: "limit", mode: "lines", line: { dash: "dashdot", color: COLOURS.limit } });
    const titles = { xaxis: { title: { text: title } }, yaxis: { title: { text: "Force [N]" }, rangemode: "tozero" } };
    const legend = { showlegend: true, legend: { orientation: "h", y: 1.3, x: 0 }, margin: { l: 48, r: 12, t: 44, b: 40 } };
    Plotly.react(id, traces, layout({ ...titles, ...legend }), CONFIG);
  }
}

function plane(Plotly, answer, state) {
  const limit = answer.speed.limit_N;
  const grid = { x: answer.distance_m, y: answer.height_m, z: answer.distance_m.length ? answer.height_m.map((_, j) => answer.place_bound_N.map((row) => row[j])) : [] };
  const colorbar = { title: { text: "N" }, thickness: 12, outlinewidth: 0 };
  const hovertemplate = "%{x:.3f} m, %{y:.3f} m: bound %{z:.1f} N<extra></extra>";
  const marker = { ...HERE, size: 12, line: { color: "#fff", width: 2 } };
  const traces = [
    { type: "heatmap", ...grid, colorscale: SCALE, colorbar, hovertemplate },
    { x: [state.distance_m], y: [state.height_m], mode: "markers", marker, hoverinfo: "skip" },
  ];
  if (limit !== null) {
    const contours = { type: "constraint", operation: "=", value: limit };
    traces.push({ type: "contour", ...grid, contours, line: { color: "#fff", width: 3 }, hoverinfo: "skip", showscale: false });
  }
  Plotly.react("plane", traces, layout({ xaxis: { title: { text: "Distance [m]" } }, yaxis: { title: { text: "Height [m]" } } }), CONFIG);
}

async function draw(answers) {
  for (const chart of document.querySelectorAll(".charts .chart")) chart.classList.toggle("stale", !answers);
  if (!answers) return;
  const [answer, state] = [data("answer-data"), chosenState()];
  workspace?.show(Object.values(state));
  const Plotly = await plotly();
  lines(Plotly, answer, state);
  plane(Plotly, answer, state);
}

async function fill() {
  const response = await fetch(canvas.dataset.workspace);
  if (!response.ok) return;
  const cube = await response.json();
  if (!ofThisMap(`${cube.map_sha256} ${cube.limits_sha256}`)) return;
  workspace = block(canvas, cube, data("map-data").measured_states);
  workspace.show(Object.values(chosenState()));
  document.getElementById("forces").replaceChildren(...colourBar(...workspace.range.map((force) => `${force.toFixed(0)} N`)));
}

live(draw);
onThemeChange(() => [draw(true), workspace?.draw()]);
fill();
