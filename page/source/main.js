/* Starts the page that this is. */

import "uplot/dist/uPlot.min.css";
import "./drawing.css";

import { comparison } from "./comparison.js";
import { embedded } from "./data.js";
import { report } from "./report.js";

const PAGES = { report, comparison };

const { page } = document.body.dataset;
PAGES[page](await embedded(document.getElementById("data")));
