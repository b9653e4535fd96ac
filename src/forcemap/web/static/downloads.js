// What takes its time to be made says so: a file is asked for, a clock runs beside it, and it is handed over when it is there.
import { GONE } from "./live.js";
import { waited, waitingFor } from "./wait.js";

async function take(form, button, address) {
  const state = form.querySelector(".state");
  const start = Date.now();
  const words = waitingFor("");
  const clock = words.appendChild(document.createElement("span"));
  const tick = () => (clock.textContent = `${form.dataset.doing}, ${Math.round((Date.now() - start) / 1000)} s`);
  const running = setInterval(tick, 1000);
  tick();
  state.replaceChildren(words);
  button.disabled = true;
  const response = await waited(fetch(address)).catch(() => null);
  const content = await response?.blob().catch(() => null);
  clearInterval(running);
  button.disabled = false;
  if (!response?.ok || !content) {
    const error = content && (await content.text().then(JSON.parse).catch(() => null));
    state.replaceChildren(Object.assign(document.createElement("p"), { className: "problem", textContent: error?.error.message ?? GONE }));
    return;
  }
  const name = response.headers.get("content-disposition").match(/filename="(.+)"/)[1];
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(content), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  state.replaceChildren(Object.assign(document.createElement("p"), { className: "note", textContent: `${name} is made` }));
}

for (const form of document.querySelectorAll("form[data-doing]"))
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const button = event.submitter ?? form.querySelector("button:not(.help)");
    const action = button.hasAttribute("formaction") ? button.formAction : form.action;
    take(form, button, `${action}?${new URLSearchParams(new FormData(form))}`);
  });
