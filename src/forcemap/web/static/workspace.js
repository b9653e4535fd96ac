// The workspace as a block of points that is turned by hand. The corner towards the viewer is cut away down to the state
// of the sliders, so that the forces around it are seen. All points are drawn in every picture, without a graphics card.
import { floored, ink as inkOf, viridis } from "./look.js";

const AXES = [["Distance", "m"], ["Height", "m"], ["Speed", "m/s"]];
const PALETTE = Array.from({ length: 256 }, (_, i) => {
  const [r, g, b] = viridis(i / 255).match(/\d+/g).map(Number);
  return (255 << 24) | (b << 16) | (g << 8) | r;
});
const RADIANS_A_PIXEL = 0.008;
const CORNERS = [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [i & 1, (i >> 1) & 1, (i >> 2) & 1].map((bit) => 2 * bit - 1));
const EDGES = CORNERS.flatMap((a, i) => CORNERS.flatMap((b, j) => (i < j && a.filter((value, k) => value !== b[k]).length === 1 ? [[a, b]] : [])));

// cube: the answer of /workspace; states: measured states
export function block(canvas, cube, states) {
  const axes = [cube.distance_m, cube.height_m, cube.speed_mps];
  const scaled = (value, k) => (axes[k].at(-1) > axes[k][0] ? (2 * (value - axes[k][0])) / (axes[k].at(-1) - axes[k][0]) - 1 : 0);
  const known = cube.force_N.map((force, i) => (force === null ? -1 : i)).filter((i) => i >= 0);
  const forces = known.map((i) => cube.force_N[i]);
  const [lowest, highest] = forces.reduce(([low, high], force) => [Math.min(low, force), Math.max(high, force)], [Infinity, -Infinity]);
  const count = axes.map((axis) => axis.length);
  const places = new Float32Array(3 * known.length);
  const colours = new Int32Array(known.length);
  known.forEach((i, n) => {
    const index = [Math.floor(i / (count[1] * count[2])), Math.floor(i / count[2]) % count[1], i % count[2]];
    index.forEach((at, k) => (places[3 * n + k] = scaled(axes[k][at], k)));
    colours[n] = PALETTE[Math.round((255 * (forces[n] - lowest)) / (highest - lowest || 1))];
  });
  const measured = states.filter((s) => s.force_N !== null).map((s) => [s.distance_m, s.height_m, s.speed_mps].map(scaled));

  let [turn, tilt, here, waiting] = [0.6, 0.5, [0, 0, 0], false];
  const layer = document.createElement("canvas");

  function draw() {
    waiting = false;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (!width) return;
    Object.assign(canvas, { width, height });
    Object.assign(layer, { width, height });
    const context = canvas.getContext("2d");
    const ink = inkOf();
    const size = Math.min(width, height) * 0.27;
    const [ct, st, cp, sp] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
    // right, up and towards the viewer, each as a direction in distance, height, speed
    const right = [ct, st, 0].map((x) => x * size);
    const up = [-st * sp, ct * sp, cp].map((x) => x * size);
    const near = [st * cp, -ct * cp, sp];
    const at = ([x, y, z]) => [width / 2 + right[0] * x + right[1] * y, height / 2 - up[0] * x - up[1] * y - up[2] * z];
    const depth = ([x, y, z]) => near[0] * x + near[1] * y + near[2] * z;

    const front = CORNERS.reduce((best, corner) => (depth(corner) > depth(best) ? corner : best));
    const back = front.map((value) => -value);
    const image = new ImageData(width, height);
    const pixels = new Int32Array(image.data.buffer);
    const depths = new Float32Array(width * height).fill(-Infinity);
    const dot = Math.ceil((2.3 * size) / Math.max(...count));
    let drawn = 0;
    for (let n = 0; n < colours.length; n++) {
      const [x, y, z] = [places[3 * n], places[3 * n + 1], places[3 * n + 2]];
      if ((x - here[0]) * front[0] > 0.001 && (y - here[1]) * front[1] > 0.001 && (z - here[2]) * front[2] > 0.001) continue;
      const left = (width / 2 + right[0] * x + right[1] * y - dot / 2) | 0;
      const top = (height / 2 - up[0] * x - up[1] * y - up[2] * z - dot / 2) | 0;
      const close = near[0] * x + near[1] * y + near[2] * z;
      drawn++;
      if (left < 0 || top < 0 || left + dot > width || top + dot > height) continue;
      for (let row = top; row < top + dot; row++)
        for (let pixel = row * width + left; pixel < row * width + left + dot; pixel++)
          if (close > depths[pixel]) {
            depths[pixel] = close;
            pixels[pixel] = colours[n];
          }
    }
    layer.getContext("2d").putImageData(image, 0, 0);
    context.drawImage(layer, 0, 0);
    canvas.dataset.points = String(drawn);

    // the edges that are seen: those of the block, and of the corner that is cut away
    const notch = (corner) => corner.map((value, k) => (value === front[k] ? value : here[k]));
    context.strokeStyle = "rgba(255, 255, 255, 0.55)";
    for (const [a, b] of EDGES) {
      if (a !== front && b !== front) stroke(context, at(notch(a)), at(notch(b)));
      if ([a, b].some((corner) => same(corner, back))) continue;
      const [from, to] = b === front ? [b, a] : [a, b];
      stroke(context, at(from === front ? notch(to) : from), at(to));
    }

    for (const state of measured) {
      const [x, y] = at(state);
      if (depth(state) > depths[Math.round(y) * width + Math.round(x)] - 0.06) spot(context, x, y, 3.5, "#000", "#fff");
    }
    spot(context, ...at(here), 6.5, "#D55E00", "#fff");
    label(context, at, front, back, ink);
  }

  function label(context, at, front, back, ink) {
    context.fillStyle = ink;
    context.font = `12px ${getComputedStyle(document.documentElement).getPropertyValue("--font")}`;
    AXES.forEach(([words, unit], k) => {
      // an edge of the outline: for the floor the lower ones, for speed the leftmost
      const outline = EDGES.filter(([a, b]) => a[k] !== b[k] && ![a, b].some((corner) => corner === front || same(corner, back)));
      const middle = ([a, b]) => at(a).map((value, i) => (value + at(b)[i]) / 2);
      const edge = outline.reduce((best, each) => (k === 2 ? middle(each)[0] < middle(best)[0] : middle(each)[1] > middle(best)[1]) ? each : best);
      const [x, y] = middle(edge);
      const centre = at([0, 0, 0]);
      const out = (from, far) => {
        const length = Math.hypot(from[0] - centre[0], from[1] - centre[1]);
        return [from[0] + (far * (from[0] - centre[0])) / length, from[1] + (far * (from[1] - centre[1])) / length];
      };
      const text = (words, [px, py]) => {
        context.textAlign = px < centre[0] - 20 ? "right" : px > centre[0] + 20 ? "left" : "center";
        const wide = context.measureText(words).width;
        const room = { right: [wide + 2, canvas.width], left: [0, canvas.width - wide - 2], center: [wide / 2, canvas.width] };
        const [low, high] = room[context.textAlign];
        context.fillText(words, Math.min(Math.max(px, low), high), py + 4);
      };
      text(`${words} [${unit}]`, out([x, y], 16));
      for (const corner of edge) {
        const end = axes[k][corner[k] > 0 ? axes[k].length - 1 : 0];
        const inwards = [0.84 * at(corner)[0] + 0.16 * x, 0.84 * at(corner)[1] + 0.16 * y];
        text(k === 2 ? floored(end) : String(Number(end.toFixed(3))), out(inwards, 9));
      }
    });
  }

  function soon() {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(draw);
  }

  canvas.addEventListener("pointerdown", (event) => {
    let from = [event.clientX, event.clientY];
    const move = ({ clientX, clientY }) => {
      turned(RADIANS_A_PIXEL * (from[0] - clientX), RADIANS_A_PIXEL * (clientY - from[1]));
      from = [clientX, clientY];
    };
    const stop = () => canvas.removeEventListener("pointermove", move);
    canvas.setPointerCapture(event.pointerId);
    canvas.addEventListener("pointermove", move);
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, stop, { once: true });
  });
  canvas.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (!way) return;
    event.preventDefault();
    turned(...way);
  });

  function turned(by, up) {
    turn += by;
    tilt = Math.min(Math.max(tilt + up, 0.05), 1.5);
    soon();
  }

  new ResizeObserver(soon).observe(canvas);
  return {
    range: [lowest, highest],
    draw: soon,
    show(state) {
      here = state.map((value, k) => Math.min(Math.max(scaled(value, k), -1), 1));
      soon();
    },
  };
}

function same(a, b) {
  return a.every((value, k) => value === b[k]);
}

function stroke(context, from, to) {
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.stroke();
}

function spot(context, x, y, radius, fill, edge) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  Object.assign(context, { fillStyle: fill, strokeStyle: edge, lineWidth: 1.5 });
  context.fill();
  context.stroke();
}
