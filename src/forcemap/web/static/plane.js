// The plane of distance and height: a value of each place in colour, lines of equal value with their numbers, measured
// states, and points that are moved in it. A click places the point, the mouse reads a place.
import { make, ticks, viridis } from "./look.js";

const PATTERNS = { capped: "M0 8L8 0", unconfirmed: "M0 0L8 8M0 8L8 0", outside: "M2 2h1.5M6 6h1.5", not_permitted: "M4 0V8M0 4H8" };
const MARGIN = { left: 52, right: 12, top: 10, bottom: 42 };
const APART = 46; // pixels between two numbers of lines

function edges(axis) {
  if (axis.length === 1) return [axis[0] - 0.01, axis[0] + 0.01];
  return [axis[0], ...axis.slice(1).map((value, i) => (value + axis[i]) / 2), axis.at(-1)];
}

// axes: {distance_m: [low, high], height_m: [low, high]}; moved(points) is called while a point is dragged;
// said(d, h, field) gives the words of a place
export function plane(element, axes, moved, said = () => "") {
  let [field, points, scale] = [null, [], null];
  const readout = Object.assign(document.createElement("p"), { className: "readout" });
  element.after(readout);

  function redraw() {
    const [width, height] = [element.clientWidth, element.clientHeight];
    if (!width) return;
    const [[d0, d1], [h0, h1]] = [axes.distance_m, axes.height_m];
    const [right, bottom] = [width - MARGIN.right, height - MARGIN.bottom];
    scale = {
      x: (d) => MARGIN.left + ((d - d0) / (d1 - d0)) * (right - MARGIN.left),
      y: (h) => bottom - ((h - h0) / (h1 - h0)) * (bottom - MARGIN.top),
      d: (x) => d0 + ((x - MARGIN.left) / (right - MARGIN.left)) * (d1 - d0),
      h: (y) => h0 + ((bottom - y) / (bottom - MARGIN.top)) * (h1 - h0),
    };
    const svg = make("svg", { width, height, role: "group", "aria-label": "Distance and height" }, patterns(element.id));
    const frame = { x: MARGIN.left, y: MARGIN.top, width: right - MARGIN.left, height: bottom - MARGIN.top };
    const ground = make("svg", { width, height, "aria-hidden": "true" }, make("rect", { ...frame, class: "ground" }), make("rect", { ...frame, fill: `url(#${element.id}-outside)` }));
    const layers = [ground];
    if (field) layers.push(coloured(width, height));
    if (field) svg.append(...hatched(), ...contours(), ...states());
    svg.append(make("rect", { ...frame, class: "frame" }), ...axis(d0, d1, h0, h1, right, bottom));
    svg.append(make("g", { class: "points" }));
    svg.addEventListener("pointermove", read);
    svg.addEventListener("pointerleave", () => (readout.textContent = ""));
    svg.addEventListener("click", put);
    const focused = [...element.querySelectorAll(".handle")].indexOf(document.activeElement);
    element.replaceChildren(...layers, svg);
    place();
    if (focused >= 0) element.querySelectorAll(".handle")[focused]?.focus();
  }

  function axis(d0, d1, h0, h1, right, bottom) {
    const parts = ticks(d0, d1, Math.max(3, (right - MARGIN.left) / 90)).map((d) =>
      make("text", { x: scale.x(d), y: bottom + 16, "text-anchor": "middle" }, String(d)));
    parts.push(...ticks(h0, h1, 5).map((h) => make("text", { x: MARGIN.left - 6, y: scale.y(h) + 4, "text-anchor": "end" }, String(h))));
    parts.push(make("text", { x: (MARGIN.left + right) / 2, y: bottom + 36, "text-anchor": "middle", class: "soft" }, "Distance [m]"));
    const middle = (MARGIN.top + bottom) / 2;
    parts.push(make("text", { x: 14, y: middle, "text-anchor": "middle", class: "soft", transform: `rotate(-90 14 ${middle})` }, "Height [m]"));
    return parts;
  }

  // smooth where all four neighbours have a value, else of one colour up to the edge of the place
  function coloured(width, height) {
    const canvas = Object.assign(document.createElement("canvas"), { width, height });
    const context = canvas.getContext("2d");
    const [xs, ys] = [field.distance_m, field.height_m];
    const [ex, ey] = [edges(xs), edges(ys)];
    const [low, high] = field.range;
    const share = (value) => (high > low ? (value - low) / (high - low) : 0.5);
    const style = getComputedStyle(element);
    const [refused] = [style.getPropertyValue("--panel").trim()];
    for (let i = 0; i < xs.length; i++)
      for (let j = 0; j < ys.length; j++) {
        if (field.outcome(i, j) === "outside") continue;
        const value = field.values[i][j];
        context.fillStyle = value === null ? refused : viridis(share(value));
        const [left, top] = [scale.x(ex[i]), scale.y(ey[j + 1])];
        context.fillRect(Math.floor(left), Math.floor(top), Math.ceil(scale.x(ex[i + 1])) - Math.floor(left), Math.ceil(scale.y(ey[j])) - Math.floor(top));
      }
    for (let i = 0; i + 1 < xs.length; i++)
      for (let j = 0; j + 1 < ys.length; j++) {
        const corners = [field.values[i][j], field.values[i + 1][j], field.values[i][j + 1], field.values[i + 1][j + 1]];
        if (corners.includes(null)) continue;
        const [x0, x1, y0, y1] = [scale.x(xs[i]), scale.x(xs[i + 1]), scale.y(ys[j + 1]), scale.y(ys[j])].map(Math.round);
        for (let x = x0; x < x1; x += 2)
          for (let y = y0; y < y1; y += 2) {
            const [u, v] = [(x - x0) / (x1 - x0), (y1 - y) / (y1 - y0)];
            context.fillStyle = viridis(share((1 - u) * ((1 - v) * corners[0] + v * corners[2]) + u * ((1 - v) * corners[1] + v * corners[3])));
            context.fillRect(x, y, 2, 2);
          }
      }
    return canvas;
  }

  function hatched() {
    const over = {};
    const [x, y] = [edges(field.distance_m).map(scale.x), edges(field.height_m).map(scale.y)];
    field.distance_m.forEach((_, i) => field.height_m.forEach((_, j) => {
      const outcome = field.outcome(i, j);
      if (PATTERNS[outcome] && outcome !== "outside") over[outcome] = `${over[outcome] ?? ""}M${x[i]} ${y[j + 1]}H${x[i + 1]}V${y[j]}H${x[i]}z`;
    }));
    return Object.entries(over).map(([outcome, d]) => make("path", { d, fill: `url(#${element.id}-${outcome})` }));
  }

  // a number stands where its line is longest and no other number is near
  function contours() {
    const [parts, taken] = [[], []];
    for (const { at, lines } of field.contours ?? []) {
      const look = field.limit === at ? "contour limit" : "contour";
      const drawn = lines.map((line) => line.map(([d, h]) => [scale.x(d), scale.y(h)]));
      for (const line of drawn) parts.push(make("polyline", { points: line.map((point) => point.map((value) => value.toFixed(1)).join(",")).join(" "), class: look }));
      const [longest] = drawn.toSorted((a, b) => b.length - a.length);
      for (const share of [0.5, 0.35, 0.65, 0.2, 0.8]) {
        const [x, y] = longest[Math.floor(share * (longest.length - 1))];
        if (x < MARGIN.left + 22 || taken.some(([a, b]) => Math.hypot(a - x, b - y) < APART)) continue;
        taken.push([x, y]);
        parts.push(make("text", { x, y: y + 4, "text-anchor": "middle", class: "number" }, field.limit === at ? `limit ${at}` : String(at)));
        break;
      }
    }
    return parts.sort((a, b) => (a.tagName === "text") - (b.tagName === "text"));
  }

  function states() {
    return (field.measured ?? []).map(([d, h]) => make("circle", { cx: scale.x(d), cy: scale.y(h), r: 3.6, class: "state" }));
  }

  function place() {
    const layer = element.querySelector(".points");
    if (!layer) return;
    const focused = [...layer.children].indexOf(document.activeElement);
    // a point beyond the plane stands at its edge
    const within = (value, [low, high]) => Math.min(Math.max(value, low), high);
    const seen = points.map(([d, h]) => [scale.x(within(d, axes.distance_m)), scale.y(within(h, axes.height_m))]);
    const line = seen.map((point) => point.join(",")).join(" ");
    const parts = points.length > 1 ? [make("polyline", { points: line, class: "path" })] : [];
    points.forEach(([d, h], i) => {
      const label = `Point ${i + 1}: distance ${d.toFixed(3)} m, height ${h.toFixed(3)} m; arrow keys move it`;
      const attributes = { transform: `translate(${seen[i].join(" ")})`, tabindex: 0, role: "button", "aria-label": label };
      const handle = make("g", { ...attributes, class: "handle", "data-point": i }, make("circle", { r: 18, class: "reach" }), make("circle", { r: 8 }));
      if (points.length > 1) handle.append(make("text", { x: 14, y: 5 }, String(i + 1)));
      handle.addEventListener("pointerdown", (event) => grab(event, i));
      handle.addEventListener("keydown", (event) => step(event, i));
      parts.push(handle);
    });
    layer.replaceChildren(...parts);
    if (focused >= 0) layer.children[focused]?.focus();
  }

  function to(i, d, h) {
    points[i] = [Math.round(d * 1000) / 1000, Math.round(h * 1000) / 1000];
    place();
    moved(points);
  }

  function grab(event, i) {
    event.preventDefault();
    const move = ({ clientX, clientY }) => to(i, ...under(clientX, clientY));
    const drop = () => {
      removeEventListener("pointermove", move);
      element.querySelectorAll(".handle")[i]?.focus();
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", drop, { once: true });
    addEventListener("pointercancel", drop, { once: true });
  }

  function under(clientX, clientY) {
    const box = element.getBoundingClientRect();
    return [scale.d(clientX - box.left), scale.h(clientY - box.top)];
  }

  function inPlane([d, h]) {
    return d >= axes.distance_m[0] && d <= axes.distance_m[1] && h >= axes.height_m[0] && h <= axes.height_m[1];
  }

  // the nearest point comes to where the plane was clicked
  function put(event) {
    const here = under(event.clientX, event.clientY);
    if (event.target.closest(".handle") || !points.length || !inPlane(here)) return;
    const far = points.map(([d, h]) => Math.hypot(scale.x(d) - scale.x(here[0]), scale.y(h) - scale.y(here[1])));
    const nearest = far.indexOf(Math.min(...far));
    to(nearest, ...here);
    element.querySelectorAll(".handle")[nearest].focus();
  }

  function step(event, i) {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!way) return;
    event.preventDefault();
    const far = event.shiftKey ? 0.05 : 0.005;
    to(i, points[i][0] + far * way[0], points[i][1] + far * way[1]);
  }

  function read(event) {
    const here = under(event.clientX, event.clientY);
    if (!field || !inPlane(here)) return;
    const [i, j] = [nearest(field.distance_m, here[0]), nearest(field.height_m, here[1])];
    readout.textContent = `${here[0].toFixed(3)} m, ${here[1].toFixed(3)} m: ${said(i, j, ...here)}`;
  }

  function nearest(axis, value) {
    const limits = edges(axis);
    return value < limits[0] || value > limits.at(-1) ? -1 : axis.findIndex((_, i) => value <= limits[i + 1]);
  }

  new ResizeObserver(redraw).observe(element);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  return {
    point(list) {
      points = list.map((point) => [...point]);
      if (scale) place();
    },
    // what is drawn: { distance_m, height_m, values, range, outcome(i, j), contours, limit, measured }; null for nothing
    show(next) {
      field = next;
      readout.textContent = "";
      if (scale) redraw();
    },
  };
}

// A swatch of an outcome, as it is drawn in a plane.
export function swatch(outcome, id) {
  const base = { width: 26, height: 16 };
  const drawn = make("svg", { ...base, "aria-hidden": "true" });
  drawn.append(make("rect", outcome === "admissible" || outcome === "capped" ? { ...base, fill: viridis(0.6) } : { ...base, class: "refused" }));
  if (outcome !== "admissible") drawn.append(make("rect", { ...base, fill: `url(#${id}-${outcome})` }));
  return drawn;
}

function patterns(id) {
  return make("defs", {}, ...Object.entries(PATTERNS).map(([name, d]) =>
    make("pattern", { id: `${id}-${name}`, width: 8, height: 8, patternUnits: "userSpaceOnUse" }, make("path", { d, class: "hatch" }))));
}
