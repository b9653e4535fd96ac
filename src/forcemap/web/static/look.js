// What charts look like: the colours of the figures, on the page's own ground.

export const COLOURS = { predicted: "#009E73", measured: "#0072B2", limit: "#D55E00", quasi: "#b8629a", here: "#D55E00" };

const VIRIDIS = ["#440154", "#482878", "#3e4989", "#31688e", "#26828e", "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725"];

export function viridis(share) {
  const position = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const from = Math.min(Math.floor(position), VIRIDIS.length - 2);
  const [a, b] = [from, from + 1].map((i) => [1, 3, 5].map((j) => parseInt(VIRIDIS[i].slice(j, j + 2), 16)));
  return `rgb(${a.map((low, i) => Math.round(low + (position - from) * (b[i] - low))).join(",")})`;
}

export const SCALE = VIRIDIS.map((colour, i) => [i / (VIRIDIS.length - 1), colour]);

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

export function layout(more = {}) {
  const style = getComputedStyle(document.documentElement);
  const [ink, line] = ["--ink", "--line"].map((name) => style.getPropertyValue(name).trim());
  const axis = { gridcolor: line, linecolor: line, zerolinecolor: line, tickcolor: line, automargin: true };
  const { xaxis, yaxis, ...rest } = more;
  return {
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: ink, family: style.getPropertyValue("--font").trim(), size: 12 },
    margin: { l: 48, r: 12, t: 8, b: 40 },
    showlegend: false,
    hovermode: "closest",
    xaxis: { ...axis, ...xaxis },
    yaxis: { ...axis, ...yaxis },
    ...rest,
  };
}

export const CONFIG = { displaylogo: false, responsive: true, displayModeBar: false };

export function onThemeChange(draw) {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
}
