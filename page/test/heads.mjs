/* Opens a report and prints as JSON whether a tool path is drawn, the heading of the chart over the length, and for each
   chart over time its heading, whether the legend covers the heading, and the names in the legend:
   node page/test/heads.mjs REPORT WIDTH */

import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [, , report, width] = process.argv;
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox"] });
const page = await browser.newPage({ viewport: { width: Number(width), height: 1000 } });
await page.goto(pathToFileURL(resolve(report)).href);
await page.waitForSelector("#time .row .u-legend");
const heads = await page.locator("#time .row").evaluateAll((rows) => rows.map((row) => {
  const words = document.createRange();
  words.selectNodeContents(row.querySelector("p"));
  const entries = [...row.querySelectorAll(".u-legend .u-series:not(:first-child)")].map((entry) => entry.getBoundingClientRect());
  const covered = [...words.getClientRects()].some((own) => entries.some((entry) =>
    own.left < entry.right && entry.left < own.right && own.top < entry.bottom && entry.top < own.bottom));
  const names = [...row.querySelectorAll(".u-legend .u-series:not(:first-child) .u-label")].map((name) => name.textContent);
  return { text: words.toString(), covered, names };
}));
const length = await page.locator("#length .row p").textContent();
const drawn = await page.locator("#path").isVisible();
await browser.close();
process.stdout.write(JSON.stringify({ drawn, length, heads }));
