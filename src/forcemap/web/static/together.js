// The page of several maps: its answer is kept up to date while the form changes.
import { live } from "./live.js";

live();
