// What charts share: colours of values, axes, parts of a drawing.

const VIRIDIS = ["#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"];

export function viridis(share) {
  const position = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const from = Math.min(Math.floor(position), VIRIDIS.length - 2);
  const [a, b] = [from, from + 1].map((i) => [1, 3, 5].map((j) => parseInt(VIRIDIS[i].slice(j, j + 2), 16)));
  return `rgb(${a.map((low, i) => Math.round(low + (position - from) * (b[i] - low))).join(",")})`;
}

const SVG = "http://www.w3.org/2000/svg";

export function make(name, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

// The colours between two figures, as they stand beside a chart.
export function colourBar(low, high) {
  const stops = Array.from({ length: 24 }, (_, i) => make("rect", { x: 5 * i, width: 5, height: 12, fill: viridis(i / 23) }));
  return [`${low} `, make("svg", { width: 120, height: 12, "aria-hidden": "true" }, ...stops), ` ${high}`];
}

// A speed as it is shown: cut to 0.001 m/s, never rounded up.
export function floored(speed) {
  if (speed === null) return "-";
  const [whole, part = ""] = (speed < 0.001 ? "0" : String(speed)).split("."); // decimals, as JSON has them
  return `${whole}.${part.padEnd(3, "0").slice(0, 3)}`;
}

// Round values between two, about so many.
export function ticks(low, high, count) {
  if (!(high > low)) return [low];
  const rough = (high - low) / count;
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = ten * [1, 2, 5, 10].find((factor) => ten * factor >= rough * (1 - 1e-9));
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, i) => Number(((first + i) * step).toFixed(9)));
}

// The colour of text, for what is drawn without a style sheet.
export function ink() {
  return getComputedStyle(document.documentElement).getPropertyValue("--ink").trim();
}

export function onThemeChange(draw) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
}
