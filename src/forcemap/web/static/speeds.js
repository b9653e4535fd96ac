// The page of safe speeds: a place that is moved over them.
import { live } from "./live.js";
import { speedPlane } from "./speed_plane.js";
import { question } from "./question.js";

const form = document.querySelector("form[data-live]");
const element = document.getElementById("plane");
const fields = ["distance_m", "height_m"].map((name) => form.elements[name]);
const ranges = fields.map((field) => form.querySelector(`[data-for=${field.id}]`));
const axes = Object.fromEntries(ranges.map((range) => [range.dataset.for, [Number(range.min), Number(range.max)]]));

const drawn = speedPlane(element, document.getElementById("counts"), axes, ([place]) => {
  fields.forEach((field, i) => {
    field.value = place[i];
    field.dispatchEvent(new Event("input", { bubbles: true }));
  });
});

live((answers) => {
  element.classList.toggle("stale", !answers);
  drawn.point([fields.map((field) => Number(field.value))]);
  drawn.ask(`${element.dataset.speeds}?${question(form)}`);
});
