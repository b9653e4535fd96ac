// The entries of campaign.toml: only those that were changed are sent; the reader's checks answer beside the entry.
import { fetched, GONE, put } from "./live.js";
import { waited } from "./wait.js";

const form = document.getElementById("conditions");
const [said, confirm, save] = ["said", "confirm", "save"].map((id) => document.getElementById(id));
const fields = [...form.querySelectorAll("[data-entry]")];
const stated = new Map(fields.map((field) => [field, field.value]));

function changed() {
  return fields.filter((field) => field.value !== stated.get(field));
}

function say(words, className = "problem") {
  said.replaceChildren(Object.assign(document.createElement("p"), { className, textContent: words }));
}

form.addEventListener("input", () => {
  confirm.hidden = true;
  const count = changed().length;
  save.disabled = !count;
  said.replaceChildren();
  for (const field of fields) field.removeAttribute("aria-invalid");
  if (count) say(`${count} ${count === 1 ? "entry" : "entries"} changed, not written yet`, "note");
});

async function write(confirmed) {
  const entries = Object.fromEntries(changed().map((field) => [field.dataset.entry, field.value]));
  const body = JSON.stringify({ entries, looked_at: form.dataset.lookedAt, confirmed });
  const headers = { "content-type": "application/json" };
  const response = await waited(fetch(form.action, { method: "POST", headers, body })).catch(() => null);
  const answer = await response?.json().catch(() => null);
  if (!response?.ok) {
    const { message = GONE, column = null } = answer?.error ?? {};
    const field = fields.find((each) => each.dataset.entry === column);
    field?.setAttribute("aria-invalid", "true");
    field?.focus();
    say(column ? `${column}: ${message}. Nothing was written.` : `${message}. Nothing was written.`);
  } else if (!answer.written) {
    say(`This would no longer fit the recordings: ${answer.binding}. Every speed is then unconfirmed until it is put right. Nothing was written yet.`);
    confirm.hidden = false;
    confirm.focus();
  } else {
    form.dataset.lookedAt = answer.looked_at;
    for (const field of fields) stated.set(field, field.value);
    save.disabled = confirm.hidden = true;
    if (answer.binding) say(`Written. ${answer.binding}`);
    else say("Written to campaign.toml", "note");
    const page = await fetched(location.href); // what is missing before signing may have changed
    if (page.answers) put(page.document);
  }
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  write(false);
});
confirm.addEventListener("click", () => write(true));
save.disabled = true;
