// How many contact points are permitted, or not: judged once the page is there, as that reads their recordings.
import { waited } from "./wait.js";

export async function pointsPermitted() {
  for (const place of document.querySelectorAll("[data-points]")) {
    const answer = await waited(fetch(place.dataset.points).then((response) => response.json()).catch(() => null));
    const points = answer?.points ?? [];
    if (answer?.problem || !points.length) continue; // what is known without judging stays
    const permitted = points.filter((point) => point.outcome !== "not_permitted").length;
    const count = place.dataset.say === "permitted" ? permitted : points.length - permitted;
    const refused = place.dataset.say === "permitted" && permitted < points.length ? `${answer.cell} ` : "";
    place.textContent = `${refused}${count} of ${points.length} contact point${points.length > 1 ? "s" : ""} ${place.dataset.say}${conditional(points, place)}`;
  }
}

// A body part that is held is permitted at a transient limit only if people have a reason.
function conditional(points, place) {
  const held = points.filter((point) => point.if_reason).length;
  return held && place.dataset.say === "permitted" ? `, ${held} of them IF the risk assessment says why` : "";
}
