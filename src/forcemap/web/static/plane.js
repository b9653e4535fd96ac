// The plane of distance and height with the safe speed of each place, and points that are moved in it.
import { ofThisMap } from "./live.js";
import { colourBar, floored, make, viridis } from "./look.js";

const WORDS = {
  admissible: "admissible", capped: "capped: no higher speed was measured", unconfirmed: "unconfirmed: no speed",
  outside: "outside what was measured: no speed", not_permitted: "contact not permitted: no speed",
};
const PATTERNS = { capped: "M0 8L8 0", unconfirmed: "M0 0L8 8M0 8L8 0", outside: "M2 2h1.5M6 6h1.5", not_permitted: "M4 0V8M0 4H8" };
const MARGIN = { left: 52, right: 12, top: 10, bottom: 42 };

function edges(axis) {
  if (axis.length === 1) return [axis[0] - 0.01, axis[0] + 0.01];
  return [axis[0], ...axis.slice(1).map((value, i) => (value + axis[i]) / 2), axis.at(-1)];
}

function ticks(low, high, count) {
  const rough = (high - low) / count;
  const ten = 10 ** Math.floor(Math.log10(rough));
  const step = ten * [1, 2, 5, 10].find((factor) => ten * factor >= rough);
  const first = Math.ceil(low / step - 1e-9);
  return Array.from({ length: Math.floor(high / step + 1e-9) - first + 1 }, (_, i) => Number(((first + i) * step).toFixed(6)));
}

// axes: {distance_m: [low, high], height_m: [low, high]}; moved(points, index) is called while a point is dragged.
export function plane(element, legend, axes, moved) {
  let [speeds, points, requested] = [null, [], ""];
  let scale = null;
  const readout = Object.assign(document.createElement("p"), { className: "note readout" });

  function redraw() {
    const [width, height] = [element.clientWidth, Math.min(Math.max(element.clientWidth * 0.55, 280), 480)];
    const [[d0, d1], [h0, h1]] = [axes.distance_m, axes.height_m];
    const [right, bottom] = [width - MARGIN.right, height - MARGIN.bottom];
    scale = {
      x: (d) => MARGIN.left + ((d - d0) / (d1 - d0)) * (right - MARGIN.left),
      y: (h) => bottom - ((h - h0) / (h1 - h0)) * (bottom - MARGIN.top),
      d: (x) => d0 + ((x - MARGIN.left) / (right - MARGIN.left)) * (d1 - d0),
      h: (y) => h0 + ((bottom - y) / (bottom - MARGIN.top)) * (h1 - h0),
    };
    const svg = make("svg", { width, height, role: "group", "aria-label": "Distance and height" }, patterns());
    const frame = { x: MARGIN.left, y: MARGIN.top, width: right - MARGIN.left, height: bottom - MARGIN.top };
    svg.append(make("rect", { ...frame, class: "ground" }), make("rect", { ...frame, fill: "url(#p-outside)" }));
    if (speeds) svg.append(...cells());
    svg.append(make("rect", { ...frame, class: "frame" }), ...axis(d0, d1, h0, h1, right, bottom));
    svg.append(make("g", { class: "points" }));
    svg.addEventListener("pointermove", say);
    const focused = [...element.querySelectorAll(".handle")].indexOf(document.activeElement);
    element.replaceChildren(svg, readout);
    place();
    if (focused >= 0) element.querySelectorAll(".handle")[focused]?.focus();
  }

  function axis(d0, d1, h0, h1, right, bottom) {
    const parts = ticks(d0, d1, Math.max(3, (right - MARGIN.left) / 90)).map((d) =>
      make("text", { x: scale.x(d), y: bottom + 16, "text-anchor": "middle" }, String(d)));
    parts.push(...ticks(h0, h1, 5).map((h) => make("text", { x: MARGIN.left - 6, y: scale.y(h) + 4, "text-anchor": "end" }, String(h))));
    parts.push(make("text", { x: (MARGIN.left + right) / 2, y: bottom + 36, "text-anchor": "middle" }, "Distance [m]"));
    const middle = (MARGIN.top + bottom) / 2;
    parts.push(make("text", { x: 14, y: middle, "text-anchor": "middle", transform: `rotate(-90 14 ${middle})` }, "Height [m]"));
    return parts;
  }

  function range() {
    const known = speeds.speed_to_program_mps.flat().filter((speed) => speed !== null);
    return [Math.min(...known), Math.max(...known)];
  }

  function cells() {
    const [x, y] = [edges(speeds.distance_m).map(scale.x), edges(speeds.height_m).map(scale.y)];
    const [low, high] = range();
    const over = {};
    const coloured = make("g", { "shape-rendering": "crispEdges" });
    speeds.to_program_outcome.forEach((column, i) => column.forEach((number, j) => {
      const box = { x: x[i], y: y[j + 1], width: x[i + 1] - x[i], height: y[j] - y[j + 1] };
      const [outcome, speed] = [speeds.outcomes[number], speeds.speed_to_program_mps[i][j]];
      if (outcome === "outside") return;
      if (outcome !== "admissible") over[outcome] = `${over[outcome] ?? ""}M${box.x} ${box.y}h${box.width}v${box.height}h${-box.width}z`;
      const look = speed === null ? { class: "refused" } : { fill: viridis(high > low ? (speed - low) / (high - low) : 0.5) };
      coloured.append(make("rect", { ...box, ...look }));
    }));
    return [coloured, ...Object.entries(over).map(([outcome, d]) => make("path", { d, fill: `url(#p-${outcome})` }))];
  }

  function place() {
    const layer = element.querySelector(".points");
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
    const move = ({ clientX, clientY }) => {
      const box = element.querySelector("svg").getBoundingClientRect();
      to(i, scale.d(clientX - box.left), scale.h(clientY - box.top));
    };
    const drop = () => {
      removeEventListener("pointermove", move);
      element.querySelectorAll(".handle")[i]?.focus();
    };
    addEventListener("pointermove", move);
    addEventListener("pointerup", drop, { once: true });
    addEventListener("pointercancel", drop, { once: true });
  }

  function step(event, i) {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (!way) return;
    event.preventDefault();
    const far = event.shiftKey ? 0.05 : 0.005;
    to(i, points[i][0] + far * way[0], points[i][1] + far * way[1]);
  }

  function say(event) {
    if (!speeds) return;
    const box = event.currentTarget.getBoundingClientRect();
    const [d, h] = [scale.d(event.clientX - box.left), scale.h(event.clientY - box.top)];
    const cell = [speeds.distance_m, speeds.height_m].map((axis, k) => nearest(axis, [d, h][k]));
    const inside = cell.every((i) => i >= 0);
    const outcome = inside ? speeds.outcomes[speeds.to_program_outcome[cell[0]][cell[1]]] : "outside";
    const speed = inside ? speeds.speed_mps[cell[0]][cell[1]] : null;
    const program = inside ? speeds.speed_to_program_mps[cell[0]][cell[1]] : null;
    const reason = inside ? speeds.reasons[speeds.to_program_reason[cell[0]][cell[1]]] : "";
    const words = outcome === "unconfirmed" ? `no speed: ${reason}` : WORDS[outcome];
    const to = program === null ? "" : `about ${floored(program)} m/s to program, ${floored(speed)} m/s at contact, `;
    readout.textContent = `${d.toFixed(3)} m, ${h.toFixed(3)} m: ${to}${words}`;
  }

  function nearest(axis, value) {
    const limits = edges(axis);
    return value < limits[0] || value > limits.at(-1) ? -1 : axis.findIndex((_, i) => value <= limits[i + 1]);
  }

  // why places inside what was measured have no speed
  function refusals() {
    const why = new Set();
    speeds.speed_to_program_mps.forEach((column, i) => column.forEach((speed, j) => {
      const outcome = speeds.outcomes[speeds.to_program_outcome[i][j]];
      if (speed === null && outcome !== "outside") why.add(speeds.reasons[speeds.to_program_reason[i][j]]);
    }));
    return why;
  }

  function explain() {
    const shown = Object.entries(speeds.counts).filter(([outcome, count]) => count > 0 && outcome !== "outside");
    const parts = [...shown, ["outside", 0]].map(([outcome, count]) => {
      const item = document.createElement("span");
      const swatch = make("svg", { width: 26, height: 16, "aria-hidden": "true" });
      const base = { width: 26, height: 16 };
      swatch.append(make("rect", outcome === "admissible" || outcome === "capped" ? { ...base, fill: viridis(0.6) } : { ...base, class: "refused" }));
      if (outcome !== "admissible") swatch.append(make("rect", { ...base, fill: `url(#p-${outcome})` }));
      item.append(swatch, count > 0 ? ` ${WORDS[outcome]} (${count} places)` : ` ${WORDS[outcome]}`);
      return item;
    });
    const [low, high] = range();
    if (Number.isFinite(low)) {
      const bar = document.createElement("span");
      bar.append(...colourBar(floored(low), `${floored(high)} m/s to program`));
      parts.unshift(bar);
    }
    for (const reason of refusals()) parts.push(Object.assign(document.createElement("p"), { className: "problem", textContent: reason }));
    legend.replaceChildren(...parts);
  }

  function show(answer, className, textContent) {
    speeds = answer;
    readout.textContent = "";
    if (scale) redraw();
    if (speeds) explain();
    else legend.replaceChildren(Object.assign(document.createElement("p"), { className, textContent }));
  }

  new ResizeObserver(redraw).observe(element);
  return {
    point(list) {
      points = list.map((point) => [...point]);
      if (scale) place();
    },
    // nothing is shown until the answer to the last question is there
    async ask(address) {
      if (address === requested) return;
      requested = address;
      show(null, "note", "Asking for the speeds of all places ...");
      const answer = await fetch(address).then((response) => (response.ok ? response.json() : null)).catch(() => null);
      if (address !== requested) return;
      if (!answer) requested = "";
      if (!answer) show(null, "problem", "No speeds of all places: there was no answer.");
      else if (ofThisMap(`${answer.map_sha256} ${answer.limits_sha256}`)) show(answer);
    },
  };
}

function patterns() {
  return make("defs", {}, ...Object.entries(PATTERNS).map(([name, d]) =>
    make("pattern", { id: `p-${name}`, width: 8, height: 8, patternUnits: "userSpaceOnUse" }, make("path", { d, class: "hatch" }))));
}
