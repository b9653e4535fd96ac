// The overview: how many contact points of each campaign are not permitted.
import { pointsPermitted } from "./permitted.js";

pointsPermitted();
