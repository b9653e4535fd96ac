// The campaign page: a file is judged as soon as it is there, and stored only when that is asked for.
import { fetched, put } from "./live.js";
import { plotly } from "./plotly.js";
import { COLOURS, CONFIG, layout, onThemeChange } from "./look.js";

const form = document.getElementById("drop");
const [zone, chosen, judged, curve] = ["zone", "file", "judged", "curve"].map((id) => document.getElementById(id));
const add = document.getElementById("add");
const added = document.getElementById("added");
const page = form.dataset.base;
let [file, answer, request] = [null, null, 0];

async function send(way, more, body) {
  const query = new URLSearchParams({ area: form.elements.area.value, file: body.name, ...more });
  if (body.size > Number(form.dataset.largest)) return { problem: `${body.name}: too large` };
  try {
    const headers = { "content-type": "application/octet-stream", accept: "text/html" };
    const response = await fetch(`${page}/${way}?${query}`, { method: "POST", headers, body });
    const html = new DOMParser().parseFromString(await response.text(), "text/html");
    return response.ok ? { content: html.body } : { problem: html.getElementById("problem")?.textContent ?? "No answer" };
  } catch {
    return { problem: "The server does not answer. Is forcemap serve still running?" };
  }
}

function show(place, { content, problem }) {
  if (content) place.replaceChildren(...content.childNodes);
  else place.replaceChildren(Object.assign(document.createElement("p"), { className: "problem", textContent: problem }));
}

async function judge(next) {
  if (!next) return;
  const own = ++request;
  file = next;
  answer = null;
  draw();
  if (add) [add.hidden, added.textContent] = [true, ""];
  judged.textContent = `Judging ${file.name} ...`;
  const judgement = await send("judge", {}, file);
  if (own !== request) return; // another file or body area is being judged
  show(judged, judgement);
  const block = document.getElementById("judged-data");
  answer = block && JSON.parse(block.textContent);
  draw();
  if (add && answer?.kind === "recording") add.hidden = false;
}

async function draw() {
  curve.hidden = !answer?.curves;
  if (curve.hidden) return;
  const ink = layout().font.color;
  const traces = answer.curves.map((recorded, i) => ({ x: recorded.time_s, y: recorded.force_N, name: answer.recordings[i].recording, line: { width: 1.5 } }));
  traces[0].line.color = COLOURS.measured;
  const shapes = [];
  const annotations = [];
  const level = (force, words, color, dash) => {
    if (force === null) return;
    shapes.push({ type: "line", xref: "paper", x0: 0, x1: 1, y0: force, y1: force, line: { color, dash, width: 1.5 } });
    annotations.push({ xref: "paper", x: 1, y: force, xanchor: "right", yanchor: "bottom", showarrow: false, text: words, font: { color } });
  };
  level(answer.transient_limit_N, "transient limit", COLOURS.limit, "dash");
  level(answer.quasi_static_limit_N, "quasi-static limit", COLOURS.quasi, "dashdot");
  for (const impact of answer.impacts.filter((one) => one.recording === answer.recordings[0].recording)) {
    const end = impact.phase1_end_s;
    shapes.push({ type: "line", yref: "paper", y0: 0, y1: 1, x0: end, x1: end, line: { color: ink, dash: "dot", width: 1 } });
    traces.push({ x: [impact.peak_time_s], y: [impact.peak_force_N], mode: "markers", name: `Phase I peak, impact ${impact.impact}`, marker: { symbol: "triangle-down", size: 11, color: "#F0E442", line: { color: ink, width: 1 } } });
  }
  const titles = { xaxis: { title: { text: "Time [s]" } }, yaxis: { title: { text: "Contact force [N]" } } };
  const shown = answer;
  const { react } = await plotly();
  if (shown === answer) react(curve, traces, layout({ ...titles, shapes, annotations }), CONFIG);
}

chosen.addEventListener("change", () => judge(chosen.files[0]));
form.addEventListener("submit", (event) => event.preventDefault());
form.elements.area.addEventListener("change", () => judge(file));
for (const name of ["dragenter", "dragover"])
  zone.addEventListener(name, (event) => {
    event.preventDefault();
    zone.classList.add("over");
  });
for (const name of ["dragleave", "drop"]) zone.addEventListener(name, () => zone.classList.remove("over"));
zone.addEventListener("drop", (event) => {
  event.preventDefault();
  judge(event.dataTransfer.files[0]);
});
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => event.preventDefault()); // a file dropped beside the zone does not replace the page

add?.addEventListener("submit", async (event) => {
  event.preventDefault();
  const run = add.elements.run.value.trim();
  const [body, own] = [file, request];
  added.textContent = `Adding ${body.name} ...`;
  const result = await send("recordings", run ? { run } : {}, body);
  const { content, problem } = result;
  show(added, !problem || problem.includes(body.name) ? result : { problem: `${body.name}: ${problem}` });
  if (!content) return;
  if (own === request) add.hidden = true;
  put((await fetched(page)).document);
});
onThemeChange(draw);
