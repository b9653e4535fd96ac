// The page of one recording: its curve.
import { curve } from "./curve.js";
import { data } from "./live.js";

const answer = data("recording-data");
if (answer?.curves) curve(document.querySelector(".chart.curve"), answer);
