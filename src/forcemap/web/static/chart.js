// A chart of lines over one axis: drawn as large as its place, read by the mouse or the arrow keys.
import { make, ticks } from "./look.js";

const MARGIN = { left: 52, right: 14, top: 22, bottom: 40 };

// drawing: { x, y: titles of the axes; digits: [of x, of y];
//   lines: [{ x, y, name, look }], levels: [{ y, name, look }], marks: [{ x, name }], spots: [{ x, y, name, look }],
//   bands: [{ from, to }] }; null in y leaves a gap
export function chart(element) {
  let [drawing, scale, at, seen] = [null, null, null, null];
  element.tabIndex = 0;
  element.setAttribute("role", "img");
  const readout = Object.assign(document.createElement("p"), { className: "readout" });
  readout.setAttribute("aria-live", "polite");
  const keys = Object.assign(document.createElement("div"), { className: "keys" });
  element.before(keys);
  element.after(readout);

  function redraw() {
    const [width, height] = [element.clientWidth, element.clientHeight];
    if (!drawing || !width) return;
    const { lines, levels = [], marks = [], spots = [], bands = [] } = drawing;
    const xs = drawing.span ?? range(lines.flatMap((line) => [line.x[0], line.x.at(-1)]));
    const ys = range([0, ...lines.flatMap((line) => line.y), ...levels.map((level) => level.y), ...spots.map((spot) => spot.y)]);
    const top = ys[1] + 0.06 * (ys[1] - ys[0] || 1);
    const [right, bottom] = [width - MARGIN.right, height - MARGIN.bottom];
    scale = {
      x: (x) => MARGIN.left + ((x - xs[0]) / (xs[1] - xs[0] || 1)) * (right - MARGIN.left),
      y: (y) => bottom - ((y - ys[0]) / (top - ys[0] || 1)) * (bottom - MARGIN.top),
      value: (x) => xs[0] + ((x - MARGIN.left) / (right - MARGIN.left)) * (xs[1] - xs[0]),
      within: xs,
    };
    const svg = make("svg", { width, height, "aria-hidden": "true" });
    const frame = { x: MARGIN.left, y: MARGIN.top, width: right - MARGIN.left, height: bottom - MARGIN.top };
    for (const { from, to } of bands) svg.append(make("rect", { ...frame, x: scale.x(from), width: Math.max(0, scale.x(to) - scale.x(from)), class: "band" }));
    for (const y of ticks(ys[0], top, 5)) {
      svg.append(make("line", { x1: MARGIN.left, x2: right, y1: scale.y(y), y2: scale.y(y), class: "grid" }));
      svg.append(make("text", { x: MARGIN.left - 6, y: scale.y(y) + 4, "text-anchor": "end" }, String(y)));
    }
    for (const x of ticks(...xs, Math.max(3, frame.width / 90))) svg.append(make("text", { x: scale.x(x), y: bottom + 16, "text-anchor": "middle" }, String(x)));
    svg.append(make("text", { x: (MARGIN.left + right) / 2, y: height - 6, "text-anchor": "middle", class: "soft" }, drawing.x));
    svg.append(make("text", { x: 4, y: 13, class: "soft" }, drawing.y), make("rect", { ...frame, class: "frame" }));
    for (const { x, name } of marks) {
      svg.append(make("line", { x1: scale.x(x), x2: scale.x(x), y1: MARGIN.top, y2: bottom, class: "mark" }));
      svg.append(make("text", { x: scale.x(x) + 4, y: MARGIN.top + 12, class: "soft" }, name));
    }
    for (const { y, look } of levels) svg.append(make("line", { x1: MARGIN.left, x2: right, y1: scale.y(y), y2: scale.y(y), class: `level ${look}` }));
    for (const { x, y, look } of lines) for (const part of pieces(x, y)) svg.append(make("polyline", { points: part, class: look }));
    for (const { x, y, look } of spots) svg.append(make("circle", { cx: scale.x(x), cy: scale.y(y), r: 5.5, class: look }));
    svg.append(make("g", { class: "reading" }));
    element.replaceChildren(svg);
    keys.replaceChildren(...[...lines, ...levels].filter((each) => each.name).map(key), ...spots.filter((spot) => spot.name).map(key));
    read(at);
  }

  function pieces(x, y) {
    const parts = [[]];
    y.forEach((value, i) => (value === null ? parts.push([]) : parts.at(-1).push(`${scale.x(x[i]).toFixed(1)},${scale.y(value).toFixed(1)}`)));
    return parts.filter((part) => part.length > 1).map((part) => part.join(" "));
  }

  function key({ name, look, x, y }) {
    const item = document.createElement("span");
    const sample = make("svg", { width: 26, height: 10, "aria-hidden": "true" });
    const spot = typeof x === "number" && typeof y === "number";
    sample.append(spot ? make("circle", { cx: 13, cy: 5, r: 4, class: look }) : make("polyline", { points: "1,5 25,5", class: look }));
    const holder = Object.assign(document.createElement("span"), { className: "chart" });
    holder.append(sample);
    item.append(holder, name);
    return item;
  }

  // what the lines say nearest to a value of x
  function read(value) {
    const layer = element.querySelector(".reading");
    at = value;
    if (!layer) return;
    if (value === null) {
      layer.replaceChildren();
      readout.textContent = "";
      return;
    }
    const [dx, dy] = drawing.digits;
    const nearest = drawing.lines.map((line) => line.x.reduce((best, x, i) => (Math.abs(x - value) < Math.abs(line.x[best] - value) ? i : best), 0));
    const x = drawing.lines[0].x[nearest[0]];
    seen = nearest[0];
    layer.replaceChildren(make("line", { x1: scale.x(x), x2: scale.x(x), y1: MARGIN.top, y2: element.clientHeight - MARGIN.bottom, class: "reader" }));
    const said = drawing.lines.map((line, k) => [line.name, line.y[nearest[k]]]).map(([name, y]) => `${name} ${y === null ? "not measured here" : `${y.toFixed(dy)} N`}`);
    readout.textContent = `${x.toFixed(dx)} ${unit(drawing.x)}: ${said.join(", ")}`;
  }

  element.addEventListener("pointermove", (event) => {
    if (!scale) return;
    const value = scale.value(event.clientX - element.getBoundingClientRect().left);
    read(value < scale.within[0] || value > scale.within[1] ? null : value);
  });
  element.addEventListener("pointerleave", () => read(null));
  element.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!way || !drawing) return;
    event.preventDefault();
    const x = drawing.lines[0].x;
    const step = event.shiftKey ? 10 * way : way;
    const from = at === null ? (way > 0 ? -1 : x.length) : seen;
    read(x[Math.min(Math.max(from + step, 0), x.length - 1)]);
  });
  new ResizeObserver(redraw).observe(element);
  return (next) => {
    drawing = next;
    redraw();
  };
}

function range(values) {
  const known = values.filter((value) => value !== null && Number.isFinite(value));
  return [Math.min(...known), Math.max(...known)];
}

function unit(title) {
  return title.match(/\[(.+)\]/)?.[1] ?? "";
}
