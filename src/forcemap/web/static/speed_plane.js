// The plane of safe speeds: asked for with the body area, contact and bound of a form, and explained below.
import { ofThisMap } from "./live.js";
import { colourBar, floored } from "./look.js";
import { plane, swatch } from "./plane.js";
import { waited, waitingFor } from "./wait.js";

const PLACES = 10_000; // so many that the edge of what is permitted is seen as it is
const WORDS = {
  admissible: "admissible", capped: "capped: no higher speed was measured", unconfirmed: "unconfirmed: no speed",
  outside: "outside what was measured: no speed", not_permitted: "contact not permitted: no speed",
};

export function speedPlane(element, legend, axes, moved) {
  let [speeds, requested] = [null, ""];
  const drawn = plane(element, axes, moved, say);

  function outcome(i, j) {
    return speeds.outcomes[speeds.to_program_outcome[i][j]];
  }

  function say(i, j, d, h) {
    const inside = i >= 0 && j >= 0;
    const found = inside ? outcome(i, j) : "outside";
    const [program, contact] = inside ? [speeds.speed_to_program_mps[i][j], speeds.speed_mps[i][j]] : [null, null];
    const words = found === "unconfirmed" ? `no speed: ${speeds.reasons[speeds.to_program_reason[i][j]]}` : WORDS[found];
    const to = program === null ? "" : `about ${floored(program)} m/s to program, ${floored(contact)} m/s at contact, `;
    return `${to}${words}${measured(d, h)}`;
  }

  function measured(d, h) {
    const near = speeds.measured.filter((state) => Math.hypot(state.distance_m - d, state.height_m - h) < 0.012);
    return near.length ? `; measured here at ${near.map((state) => state.speed_mps.toFixed(3)).join(", ")} m/s` : "";
  }

  function range() {
    const known = speeds.speed_to_program_mps.flat().filter((speed) => speed !== null);
    return [Math.min(...known), Math.max(...known)];
  }

  // why places inside what was measured have no speed
  function refusals() {
    const why = new Set();
    speeds.speed_to_program_mps.forEach((column, i) => column.forEach((speed, j) => {
      if (speed === null && outcome(i, j) !== "outside") why.add(speeds.reasons[speeds.to_program_reason[i][j]]);
    }));
    return why;
  }

  function explain() {
    const shown = Object.entries(speeds.counts).filter(([name, count]) => count > 0 && name !== "outside");
    const within = shown.reduce((sum, [, count]) => sum + count, 0);
    const parts = [...shown, ["outside", 0]].map(([name, count]) => {
      const item = document.createElement("span");
      item.append(swatch(name, element.id), count > 0 ? ` ${WORDS[name]} (${((100 * count) / within).toFixed(0)} % of ${within} places)` : ` ${WORDS[name]}`);
      return item;
    });
    const [low, high] = range();
    if (Number.isFinite(low)) {
      const bar = document.createElement("span");
      bar.append(...colourBar(floored(low), `${floored(high)} m/s to program`));
      parts.unshift(bar);
    }
    for (const reason of refusals()) parts.push(Object.assign(document.createElement("p"), { className: "note", textContent: `Places without a speed: ${reason}` }));
    legend.replaceChildren(...parts);
  }

  function show(answer, words = null) {
    speeds = answer;
    if (speeds) {
      const { distance_m, height_m, speed_to_program_mps: values, contours } = speeds;
      drawn.show({ distance_m, height_m, values, range: range(), outcome, contours, measured: speeds.measured.map((state) => [state.distance_m, state.height_m]) });
      explain();
    } else {
      drawn.show(null);
      legend.replaceChildren(words);
    }
  }

  return {
    point: drawn.point,
    // nothing is shown until the answer to the last question is there
    async ask(address) {
      if (address === requested) return;
      requested = address;
      show(null, waitingFor("Asking for the speeds of all places"));
      const answer = await waited(fetch(`${address}&places=${PLACES}`).then((response) => (response.ok ? response.json() : null)).catch(() => null));
      if (address !== requested) return;
      if (!answer) requested = "";
      if (!answer) show(null, Object.assign(document.createElement("p"), { className: "problem", textContent: "No speeds of all places: there was no answer." }));
      else if (ofThisMap(`${answer.map_sha256} ${answer.limits_sha256}`)) show(answer);
    },
  };
}
