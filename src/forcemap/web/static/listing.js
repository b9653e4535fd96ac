// A page whose tables alone need script.
import { tables } from "./tables.js";

tables(document);
