// The campaign page: a file is judged as soon as it is there, and stored only when that is asked for.
import { refresh } from "./campaign.js";
import { curve } from "./curve.js";
import { fetched, put } from "./live.js";
import { waited, waitingFor } from "./wait.js";

const form = document.getElementById("drop");
const [zone, chosen, judged, place] = ["zone", "file", "judged", "curve"].map((id) => document.getElementById(id));
const add = document.getElementById("add");
const added = document.getElementById("added");
const chartOf = document.getElementById("curve-of");
const page = form.dataset.base;
let [file, answer, request] = [null, null, 0];

async function send(way, more, body) {
  const query = new URLSearchParams({ area: form.elements.area.value, file: body.name, ...more });
  if (body.size > Number(form.dataset.largest)) return { problem: `${body.name}: too large` };
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
  if (!next) return;
  const own = ++request;
  file = next;
  answer = null;
  draw();
  if (add) [add.hidden, added.textContent] = [true, ""];
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

chosen.addEventListener("change", () => judge(chosen.files[0]));
form.addEventListener("submit", (event) => event.preventDefault());
form.elements.area.addEventListener("change", async () => {
  judge(file);
  const address = `${page}?${new URLSearchParams({ area: form.elements.area.value })}`;
  const next = await fetched(address);
  if (!next.answers) return;
  history.replaceState(null, "", address);
  put(next.document);
  refresh();
});
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
  added.replaceChildren(waitingFor(`Adding ${body.name}`));
  const result = await send("recordings", run ? { run } : {}, body);
  const { content, problem } = result;
  show(added, !problem || problem.includes(body.name) ? result : { problem: `${body.name}: ${problem}` });
  if (!content) return;
  if (own === request) add.hidden = true;
  put((await fetched(page)).document);
  refresh();
});
