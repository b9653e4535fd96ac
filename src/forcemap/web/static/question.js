// What all pages ask alike: body area, contact, bound and overshoot, without the place.
const NAMES = ["area", "contact", "bound", "confidence", "content", "margin", "overshoot_mps"];

export function question(form) {
  return new URLSearchParams([...new FormData(form)].filter(([name, value]) => NAMES.includes(name) && value !== ""));
}
