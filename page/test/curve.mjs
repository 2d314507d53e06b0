/* Reduces a curve that ends at 0 a little after the end of the chart, and shows numbers beside a chart; prints both
   as JSON. */

import { sampled } from "../source/curve.js";
import { tick } from "../source/numbers.js";

const speed = { x: [0, 1, 98.9999, 100.000005], y: [0, 30, 30, 0] };
const ticks = [0, -2000, 30_000_000, -30_000_000, -5_000_000, 1_000_000, -1_000_000, 2.5e-7, -0.00001234].map(tick);
process.stdout.write(JSON.stringify({ drawn: [...sampled(speed, 0, 100, 50).y], ticks }));
