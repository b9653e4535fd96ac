// The campaign's page: the next step is asked for when the page is there, a row of recordings opens with its curve.
import { curve } from "./curve.js";
import { fetched, GONE } from "./live.js";
import { pointsPermitted } from "./permitted.js";
import { tables } from "./tables.js";
import { waited, waitingFor } from "./wait.js";

const dialog = document.getElementById("opened");
const content = dialog.querySelector(".content");
const [before, after] = ["before", "after"].map((name) => dialog.querySelector(`[name=${name}]`));
let asked = "";

export function refresh() {
  tables(document);
  step();
  pointsPermitted();
}

async function step() {
  const place = document.getElementById("next");
  if (!place) return;
  const area = document.querySelector("#drop [name=area]").value;
  place.replaceChildren(waitingFor("Working out what to measure next"));
  const address = `${place.dataset.next}?${new URLSearchParams({ area, contact: place.dataset.contact })}`;
  const answer = await waited(fetch(address).then((response) => response.json()).catch(() => null));
  if (document.getElementById("next") !== place) return;
  const whole = answer?.sentence ?? answer?.error?.message ?? GONE;
  const said = Object.assign(document.createElement("p"), { textContent: answer?.what || whole });
  const doubts = answer?.what ? answer.further_warnings : (answer?.warnings ?? []);
  const parts = [said, ...why(answer?.why ?? []), ...doubts.map((textContent) => Object.assign(document.createElement("p"), { className: "problem", textContent }))];
  if (answer?.states?.length) {
    const places = answer.states.slice(0, 4).map((state) => `${state.distance_m.toFixed(2)} m, ${state.height_m.toFixed(2)} m at ${state.speed_mps.toFixed(2)} m/s (${state.expected_force_N.toFixed(0)} N expected, at most ${state.upper_force_N.toFixed(0)} N)`);
    const others = answer.states.length - places.length;
    parts.push(Object.assign(document.createElement("p"), { className: "note", textContent: `${places.join("; ")}${others ? ` and ${others} more` : ""}` }));
  }
  if (answer?.command) parts.push(Object.assign(document.createElement("code"), { textContent: answer.command }));
  place.replaceChildren(...parts);
}

function why(sentences) {
  if (!sentences.length) return [];
  const details = document.createElement("details");
  const summary = Object.assign(document.createElement("summary"), { textContent: "Why, and what it gains" });
  details.append(summary, ...sentences.map((textContent) => Object.assign(document.createElement("p"), { className: "note", textContent })));
  return [details];
}

async function open(address) {
  asked = address;
  if (!dialog.open) dialog.showModal();
  content.replaceChildren(waitingFor("Reading and judging the recording"));
  const page = await fetched(address);
  if (asked !== address || !dialog.open) return;
  const found = page.document.getElementById("recording") ?? page.document.body;
  content.replaceChildren(...found.childNodes);
  for (const [button, way] of [[before, "before"], [after, "after"]]) {
    const link = content.querySelector(`a[data-way=${way}]`);
    button.disabled = !link;
    button.onclick = () => open(link.href);
  }
  const block = content.querySelector("script[type='application/json']");
  const answer = block && JSON.parse(block.textContent);
  if (answer?.curves) curve(content.querySelector(".chart.curve"), answer);
  tables(content);
}

document.addEventListener("click", (event) => {
  const row = event.target.closest(".opens tbody tr");
  if (!row || event.ctrlKey || event.metaKey || event.shiftKey || getSelection().toString()) return;
  event.preventDefault();
  open(row.querySelector("a[href]").href);
});
dialog.querySelector("[name=close]").addEventListener("click", () => dialog.close());
dialog.addEventListener("keydown", (event) => {
  if (event.target.closest(".chart")) return; // there the arrows read the curve
  if (event.key === "ArrowLeft" && !before.disabled) before.click();
  if (event.key === "ArrowRight" && !after.disabled) after.click();
});
dialog.addEventListener("close", () => {
  asked = "";
  content.replaceChildren();
});
refresh();
