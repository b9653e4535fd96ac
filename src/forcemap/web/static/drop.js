// The campaign page: a file is judged as soon as it is there, and stored only when that is asked for. Several are not
// judged before: each is stored as the run that it is named for, and judged in the list of recordings.
import { refresh } from "./campaign.js";
import { curve } from "./curve.js";
import { fetched, put } from "./live.js";
import { waited, waitingFor } from "./wait.js";
import { dropZone } from "./zone.js";

const form = document.getElementById("drop");
const [zone, chosen, judged, place] = ["zone", "file", "judged", "curve"].map((id) => document.getElementById(id));
const add = document.getElementById("add");
const added = document.getElementById("added");
const chartOf = document.getElementById("curve-of");
const page = form.dataset.base;
let [files, answer, request] = [[], null, 0];

async function send(way, more, body) {
  const query = new URLSearchParams({ area: form.elements.area.value, file: body.name, ...more });
  if (body.size > Number(form.dataset.largest)) return { problem: `${body.name}: too large` };
  if (!query.get("area")) query.delete("area");
  if (way === "judge" && !query.get("area")) return { problem: "Choose the body area that can be hit: no body area was chosen, and none is assumed" };
  try {
    const headers = { "content-type": "application/octet-stream", accept: "text/html" };
    const response = await waited(fetch(`${page}/${way}?${query}`, { method: "POST", headers, body }));
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
  if (!next.length) return;
  const own = ++request;
  const [file, ...more] = next;
  files = [...next];
  answer = null;
  draw();
  if (add) [add.hidden, added.textContent, add.elements.run.disabled] = [!more.length, "", more.length > 0];
  if (more.length) {
    const words = add ? "each is stored as the run that it is named for" : "expected one";
    judged.replaceChildren(Object.assign(document.createElement("p"), { textContent: `${next.length} files: ${words}` }));
    return;
  }
  judged.replaceChildren(waitingFor(`Judging ${file.name}`));
  const judgement = await send("judge", {}, file);
  if (own !== request) return; // another file or body area is being judged
  show(judged, judgement);
  const block = document.getElementById("judged-data");
  answer = block && JSON.parse(block.textContent);
  draw();
  if (add && answer?.kind === "recording") add.hidden = false;
}

function draw() {
  chartOf.hidden = !answer?.curves;
  if (answer?.curves) curve(place, answer);
}

chosen.addEventListener("change", () => judge(chosen.files));
form.addEventListener("submit", (event) => event.preventDefault());
form.elements.area.addEventListener("change", async () => {
  judge(files);
  const address = `${page}?${new URLSearchParams({ area: form.elements.area.value })}`;
  const next = await fetched(address);
  if (!next.answers) return;
  history.replaceState(null, "", address);
  put(next.document);
  refresh();
});
dropZone(zone, judge);

add?.addEventListener("submit", async (event) => {
  event.preventDefault();
  const [bodies, own] = [files, request];
  const run = bodies.length > 1 ? "" : add.elements.run.value.trim();
  const unlike = []; // what is to be read of several: all but "used"
  let [stored, result] = [0, null];
  for (const body of bodies) {
    added.replaceChildren(waitingFor(`Adding ${body.name}`));
    result = await send("recordings", run ? { run } : {}, body);
    if (!result.content) break;
    stored += 1;
    if (bodies.length > 1) unlike.push(...result.content.querySelectorAll("[data-use]:not([data-use=used])"));
  }
  const [{ content, problem }, body] = [result, bodies[stored]];
  show(added, !problem || problem.includes(body.name) ? result : { problem: `${body.name}: ${problem}` });
  if (bodies.length > 1) {
    const said = Object.assign(document.createElement("p"), { textContent: `${stored} of ${bodies.length} are stored.` });
    if (content) added.replaceChildren(said, ...unlike, ...added.querySelectorAll(".problem"));
    else added.prepend(said, ...unlike);
  }
  if (content && own === request) add.hidden = true;
  if (!stored) return;
  put((await fetched(location.pathname + location.search)).document);
  refresh();
});
