// What all pages ask alike: body area, contact and bound, without the place.
const NAMES = ["area", "contact", "bound", "confidence", "content", "margin"];

export function question(form) {
  return new URLSearchParams([...new FormData(form)].filter(([name, value]) => NAMES.includes(name) && value !== ""));
}
