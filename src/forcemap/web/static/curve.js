// The curve of a recording: contact force over time, its phases, and the limits it is held against.
import { chart } from "./chart.js";

// place: where its chart is; answer: a judged file; which of its recordings
export function curve(place, answer, number = 0) {
  const { time_s, force_N } = answer.curves[number];
  const name = answer.recordings[number].recording;
  const impacts = answer.impacts.filter((impact) => impact.recording === name);
  const level = (y, name, look) => (y == null ? [] : [{ y, name: `${name} ${y.toFixed(0)} N`, look }]);
  const second = impacts.filter((impact) => impact.phase2_force_N !== null).map((impact) => impact.onset_s + 0.5);
  place.draw ??= chart(place);
  place.draw({
    x: "Time [s]", y: "Contact force [N]", digits: [4, 1],
    lines: [{ x: time_s, y: force_N, name: "force", look: "curve" }],
    levels: [...level(answer.transient_limit_N, "transient limit", "limit"), ...level(answer.quasi_static_limit_N, "quasi-static limit", "second")],
    marks: [...impacts.map((impact) => ({ x: impact.phase1_end_s, name: "Phase I ends" })), ...second.filter((x) => x < time_s.at(-1)).map((x) => ({ x, name: "Phase II" }))],
    bands: impacts.map((impact) => ({ from: impact.onset_s, to: impact.phase1_end_s })),
    spots: impacts.map((impact) => ({ x: impact.peak_time_s, y: impact.peak_force_N, name: `Phase I peak ${impact.peak_force_N.toFixed(1)} N`, look: "peak" })),
  });
}
