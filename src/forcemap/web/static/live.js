// Keeps a page up to date while its form changes: its address is asked again, and what the answer says is put in place.
// No answer is left standing that does not belong to the form, and a page is of one map: where an answer is of another,
// the campaign's files have changed, and the whole page is asked again.

import { waited } from "./wait.js";

export const GONE = "The server does not answer. Is forcemap serve still running?";

export function live(shown = () => {}) {
  const form = document.querySelector("form[data-live]");
  let asking = false;
  let again = false;
  let query = stated(rendered(form));

  async function ask() {
    document.body.classList.add("asking");
    if (asking) {
      again = true;
      return;
    }
    asking = true;
    do {
      again = false;
      query = stated(form);
      const address = `${location.pathname}?${query}`;
      const page = form.checkValidity() ? await fetched(address) : problem(unfilled(form));
      if (again) continue;
      if (page.answers) history.replaceState(null, "", address);
      if (page.answers && !ofThisMap(page.document.querySelector("main").dataset.madeOf)) return;
      put(page.document);
      shown(page.answers);
    } while (again);
    asking = false;
    document.body.classList.remove("asking");
  }

  for (const range of form.querySelectorAll("input[type=range]")) {
    const number = document.getElementById(range.dataset.for);
    range.addEventListener("input", () => (number.value = range.value));
    number.addEventListener("input", () => (range.value = number.value));
  }
  form.addEventListener("input", ask);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    ask();
  });
  addEventListener("pageshow", (event) => {
    for (const range of form.querySelectorAll("input[type=range]")) range.value = document.getElementById(range.dataset.for).value;
    if (event.persisted || stated(form) !== query) ask(); // a browser that goes back fills in what was there before
  });
  form.classList.add("scripted");
  shown(true);
  return ask;
}

// Whether something is of the map and the limits of this page; if not, the page is loaded again.
export function ofThisMap(madeOf) {
  if (madeOf === document.querySelector("main").dataset.madeOf) return true;
  location.reload();
  return false;
}

function stated(form) {
  return String(new URLSearchParams(new FormData(form)));
}

function rendered(form) {
  const copy = form.cloneNode(true);
  copy.reset();
  return copy;
}

export async function fetched(address) {
  try {
    const response = await waited(fetch(address));
    const page = new DOMParser().parseFromString(await response.text(), "text/html");
    return response.ok ? { answers: true, document: page } : problem(page.getElementById("problem")?.textContent ?? GONE);
  } catch {
    return problem(GONE);
  }
}

export function put(page) {
  for (const part of document.querySelectorAll("[data-swap]")) {
    const fresh = page.getElementById(part.id);
    if (fresh?.innerHTML === part.innerHTML || (!fresh && ["NAV", "HEADER"].includes(part.tagName))) continue;
    const open = [...part.querySelectorAll("details")].map((details) => details.open);
    part.replaceChildren(...(fresh?.childNodes ?? []));
    part.querySelectorAll("details").forEach((details, i) => (details.open = open[i] ?? details.open));
  }
}

export function data(id) {
  const block = document.getElementById(id);
  return block && JSON.parse(block.textContent);
}

function unfilled(form) {
  const field = form.querySelector(":invalid:not(fieldset)");
  const label = field.labels[0]?.firstChild.textContent.trim() ?? field.name;
  return `${label}: ${field.validationMessage}`;
}

function problem(message) {
  const page = document.implementation.createHTMLDocument();
  const said = Object.assign(page.createElement("p"), { className: "problem", textContent: message });
  const place = Object.assign(page.createElement("div"), { id: document.getElementById("verdict") ? "verdict" : "answer" });
  place.append(said);
  page.body.append(place);
  return { answers: false, document: page };
}
