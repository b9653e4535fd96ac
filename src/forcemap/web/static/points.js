// The page of contact points: a point is saved, a file is stored, and the page is asked again; what is refused is said.
import { fetched, put } from "./live.js";

const points = document.getElementById("points");
const said = document.getElementById("said");
const base = points.dataset.base;

function list() {
  return document.getElementById("points-state").dataset.list;
}

function say(words, problem = false) {
  said.textContent = words;
  said.classList.toggle("problem", problem);
  if (problem) said.focus();
}

async function sent(way, options) {
  try {
    const response = await fetch(`/api${base}/${way}`, options);
    const answer = await response.json();
    if (response.ok) return answer;
    const { message, row, column } = answer.error;
    say([row && `row ${row}`, column, message].filter(Boolean).join(", "), true);
  } catch {
    say("The server does not answer. Is forcemap serve still running?", true);
  }
  return null;
}

async function renewed() {
  const open = [...points.querySelectorAll("details[open]")].map((each) => each.closest("section").id);
  put((await fetched(location.pathname + location.search)).document);
  for (const id of open) document.getElementById(id)?.querySelector("details")?.setAttribute("open", "");
}

points.addEventListener("submit", async (event) => {
  event.preventDefault();
  const form = event.target;
  const cells = Object.fromEntries(new FormData(form));
  const body = JSON.stringify({ list_sha256: list(), replaces: form.dataset.replaces, cells });
  say("Saving ...");
  if (!(await sent("points", { method: "POST", headers: { "content-type": "application/json" }, body }))) return;
  await renewed();
  say(`${cells.point_id} is saved.`);
});

points.addEventListener("click", async (event) => {
  const point = event.target.dataset.remove;
  if (!point || !confirm(`Take ${point} out of the list? Its files stay.`)) return;
  const query = new URLSearchParams({ point, list_sha256: list() });
  if (!(await sent(`points?${query}`, { method: "DELETE" }))) return;
  await renewed();
  say(`${point} is taken out of the list.`);
});

points.addEventListener("change", async (event) => {
  const { way, point } = event.target.dataset;
  if (!way) return;
  let stored = "";
  for (const file of event.target.files) {
    if (file.size > Number(points.dataset.largest)) {
      say(`${file.name}: too large`, true);
      break;
    }
    const query = new URLSearchParams(point ? { point, list_sha256: list(), file: file.name } : { file: file.name });
    say(`Storing ${file.name} ...`);
    const headers = { "content-type": "application/octet-stream" };
    const answer = await sent(`${way}?${query}`, { method: "POST", headers, body: file });
    if (!answer) break;
    stored = `${file.name} is stored as ${answer.stored_as}.${answer.problem ? ` Not collected: ${answer.problem}` : ""}`;
    await renewed();
    say(stored, Boolean(answer.problem));
  }
});
