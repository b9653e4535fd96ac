// The task page: a point or a path that is dragged.
import { live } from "./live.js";
import { speedPlane } from "./speed_plane.js";
import { question } from "./question.js";

const form = document.querySelector("form[data-live]");
const element = document.getElementById("plane");
const field = form.elements.points;
const axes = JSON.parse(element.dataset.axes);

function points() {
  return field.value.split(";").map((point) => point.split(",").map(Number)).filter((point) => point.length === 2 && point.every(Number.isFinite));
}

function state(list) {
  field.value = list.map((point) => point.map((value) => value.toFixed(3)).join(",")).join(";");
  field.dispatchEvent(new Event("input", { bubbles: true }));
}

const drawn = speedPlane(element, document.getElementById("counts"), axes, state);

function change(list) {
  state(list);
  drawn.point(list);
}

document.getElementById("more").addEventListener("click", () => {
  const list = points();
  const [d, h] = list.at(-1) ?? [0, 0];
  const lower = h - 0.1 > axes.height_m[0] ? h - 0.1 : h + 0.1;
  if (list.length < 50) change([...list, [d, lower]]);
});
document.getElementById("less").addEventListener("click", () => {
  if (points().length > 1) change(points().slice(0, -1));
});
field.addEventListener("input", () => document.activeElement === field && drawn.point(points()));

drawn.point(points());
live((answers) => {
  element.classList.toggle("stale", !answers);
  drawn.ask(`${element.dataset.speeds}?${question(form)}`);
});
