// A wait of more than half a second shows: a line at the top of the page while anything is asked for.

const AFTER = 400; // ms; what is answered sooner would only flicker
const line = document.getElementById("wait");
let [open, leaves, timer] = [0, false, null];

function show() {
  clearTimeout(timer);
  if (open || leaves) timer = setTimeout(() => (line.hidden = false), AFTER);
  else line.hidden = true;
}

// What a promise gives; the line shows until it is there.
export async function waited(promise) {
  open += 1;
  if (open === 1) show();
  try {
    return await promise;
  } finally {
    open -= 1;
    if (!open) show();
  }
}

// A sentence and a bar in a place that an answer will fill.
export function waitingFor(words) {
  const part = Object.assign(document.createElement("p"), { className: "waiting" });
  const bar = document.createElement("progress");
  bar.setAttribute("aria-label", words);
  part.append(bar, words);
  return part;
}

function leaving(event) {
  if (event.defaultPrevented) return;
  const link = event.target.closest?.("a[href]");
  const own = event.type === "submit" ? !event.target.hasAttribute("data-live") : link && link.origin === location.origin && !link.hasAttribute("download") && !link.hash && !event.ctrlKey && !event.metaKey && !event.shiftKey && link.target !== "_blank";
  if (!own || (link && link.pathname.startsWith("/api/"))) return;
  leaves = true;
  show();
}

document.addEventListener("click", leaving);
document.addEventListener("submit", leaving);
addEventListener("pageshow", () => {
  leaves = false;
  show();
});
