/* Starts the report, the comparison or the page of the service, whichever this page is. */

import "uplot/dist/uPlot.min.css";
import "./drawing.css";

import { comparison } from "./comparison.js";
import { embedded } from "./data.js";
import { report } from "./report.js";
import { service } from "./service/app.js";

const PAGES = { report, comparison, service };

const data = document.getElementById("data");
PAGES[document.body.dataset.page](data && (await embedded(data)));
