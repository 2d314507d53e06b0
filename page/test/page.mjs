/* Uses the page of the service as a person does, and writes what it sees as JSON:
   node page/test/page.mjs ADDRESS PROGRAM FOLDER [TOKEN]
   Downloads go into the folder; with FEEDPLAN_PICTURES in the environment pictures too, in full size. */

import { readFileSync, writeFileSync } from "node:fs";
import { basename, join } from "node:path";
import { chromium } from "playwright-core";

const [, , address, program, folder, token] = process.argv;
const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";
const SOFTWARE = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
// Pixels are computed by the processor: without pictures a quarter of them will do.
const PICTURES = Boolean(process.env.FEEDPLAN_PICTURES), SCALE = PICTURES ? 1 : 0.5;
const WIDE = { width: 1440, height: 1000 }, TABLET = { width: 1024, height: 1366 };
const MACHINE = `name = "mine"  # the one in the hall
controller = { type = "grbl", junction_deviation = 0.03 }
period = 0.001
axes = [
  { name = "X", "max_velocity" = 100.0, max_acceleration = 1_000, max_jerk = 2e4 }, # [[axes]]
  { name = 'Y', max_velocity = [-80.0, 90.0], max_acceleration = 1000 },
  { "name" = "Z", max_velocity = 50, max_acceleration = 500 },
]
`;
const facts = { requests: [], errors: [] };

const browser = await chromium.launch({ executablePath: CHROMIUM, args: SOFTWARE, timeout: 180_000 });
const page = await browser.newPage({ viewport: WIDE, deviceScaleFactor: SCALE, acceptDownloads: true });
page.setDefaultTimeout(60_000);
page.on("request", (request) => facts.requests.push({ url: request.url(), hasToken: "authorization" in request.headers() }));
page.on("pageerror", (error) => facts.errors.push(error.stack));
page.on("console", (message) => message.type() === "error" && facts.errors.push(message.text()));

// A chart knows the texts on it. Those of the first 50 ms are missing, as they can be in a first picture.
await page.addInitScript(() => {
  const { fillText, clearRect } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.clearRect = function (...area) {
    this.canvas.texts = [];
    clearRect.apply(this, area);
  };
  CanvasRenderingContext2D.prototype.fillText = function (...words) {
    if (this.canvas.closest(".uplot") && performance.now() < (window.textsFrom ??= performance.now() + 50)) return;
    (this.canvas.texts ??= []).push(words[0]);
    fillText.apply(this, words);
  };
});
await page.goto(address);
if (token) {
  await page.fill("dialog input", token);
  await page.press("dialog input", "Enter");
}
await page.waitForSelector("body[data-ready]");
facts.machines = await page.locator("#machine option").count();

/* The number of coloured pixels of a canvas, and the number of different colours. */
const coloured = (selector) => page.evaluate((place) => {
  const source = document.querySelector(place);
  const flat = Object.assign(document.createElement("canvas"), { width: source.width, height: source.height }).getContext("2d");
  flat.drawImage(source, 0, 0);
  const { data } = flat.getImageData(0, 0, source.width, source.height);
  const colours = new Set();
  let count = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i + 3] < 128 || Math.max(data[i], data[i + 1], data[i + 2]) - Math.min(data[i], data[i + 1], data[i + 2]) < 40) continue;
    count += 1;
    colours.add((data[i] >> 4 << 8) | (data[i + 1] >> 4 << 4) | (data[i + 2] >> 4));
  }
  return { count, colours: colours.size };
}, selector);
const text = (selector) => page.locator(selector).textContent();
// A busy machine draws late: two frames must follow the pause.
const settled = async () => {
  await page.waitForTimeout(300);
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
};
const jobs = () => page.evaluate(async (given) => (await (await fetch("/v1/jobs", { headers: given ? { Authorization: `Bearer ${given}` } : {} })).json()).jobs, token ?? "");
const picture = async (name) => PICTURES && page.screenshot({ path: join(folder, `${name}.png`) });

// A machine file as people write them: comments, a table within a line, dotted and quoted keys.
await page.locator("summary").first().click();
await page.locator("summary").nth(1).click();
const limits = () => page.locator("#axes-table tr:not(:first-child)").evaluateAll((rows) => rows.map((row) => [row.firstChild.textContent, ...[...row.querySelectorAll("input")].map((input) => input.value)]));
await page.locator("#machine-text").fill(MACHINE);
await page.waitForFunction(() => document.querySelector("#axes-table input").value === "100");
facts.limits = await limits();
await page.locator("#axes-table input").first().fill("-1");
await page.locator("#axes-table input").first().press("Tab");
await page.waitForFunction(() => document.getElementById("machine-told").textContent);
facts.refusedLimit = await text("#machine-told");
await page.locator("#axes-table input").first().fill("120");
await page.locator("#axes-table input").first().press("Tab");
await page.waitForFunction(() => !document.getElementById("machine-told").textContent);
facts.changedLimits = await limits();
facts.changedText = await page.inputValue("#machine-text");
await page.locator("summary").nth(1).click();
await page.locator("summary").first().click();

// A program that is refused: line and remedy are shown.
await page.setInputFiles("#file", { name: "wrong.ngc", mimeType: "text/plain", buffer: Buffer.from("G21 G90\nG1 X10 F1000\nG1 X\nM2\n") });
await page.waitForSelector("#failure:not([hidden])");
facts.refused = await text("#failure");

// A program is dropped; the stages of its plan are shown.
const stages = page.evaluate(() => new Promise((resolve) => {
  const seen = [];
  const watch = new MutationObserver(() => {
    const stage = document.getElementById("stage").textContent.split(" ")[0];
    if (seen.at(-1) !== stage) seen.push(stage);
    if (!document.getElementById("result").hidden) {
      watch.disconnect();
      resolve({ seen, time: performance.now() });
    }
  });
  watch.observe(document.body, { subtree: true, childList: true, attributes: true, characterData: true });
}));
const dropped = await page.evaluate(({ name, content }) => {
  const transfer = new DataTransfer();
  transfer.items.add(new File([Uint8Array.from(atob(content), (letter) => letter.charCodeAt(0))], name));
  const start = performance.now();
  document.body.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, bubbles: true, cancelable: true }));
  return start;
}, { name: basename(program), content: readFileSync(program).toString("base64") });
const { seen, time } = await stages;
facts.stages = seen;
facts.drawnAfter = (time - dropped) / 1000;
await page.waitForSelector("#path .scene:not([aria-busy])");
await settled();
// Numbers along the axes tell what a chart shows; pixels of the same chart can differ in a shade.
await page.waitForFunction(() => document.querySelector("#speed canvas").texts?.length > 4);
const whole = await page.evaluate(() => document.querySelector("#speed canvas").texts.join(" "));
facts.figures = await text("#figures");
facts.path = await coloured("#path canvas");
await picture("page");

// Another colour mode.
for (const name of ["feed", "active", "lost"]) {
  await page.click(`#path-tools [data-name=${name}]`);
  facts[name] = { ...(await coloured("#path canvas")), legend: await text("#path .legend, #path + .legend, .pane .legend") };
}
await page.click("#path-tools [data-name=speed]");

// One cursor in the chart, the tool path and the source.
const chart = page.locator("#speed .u-over");
await chart.scrollIntoViewIfNeeded();
const box = await chart.boundingBox();
await page.mouse.move(box.x + 0.37 * box.width, box.y + 60);
await settled();
const chosen = () => page.evaluate(() => ({ told: document.getElementById("first-told").textContent, line: document.querySelector(".source .chosen")?.dataset.line, text: document.querySelector(".source .chosen")?.textContent }));
facts.pointed = await chosen();
facts.axesTold = await text("#axes .row:nth-child(2) .u-legend");

// Dragging zooms, a double click goes back to the first picture.
const shows = (all) => page.waitForFunction(([texts, same]) => (document.querySelector("#speed canvas").texts.join(" ") === texts) === same, [whole, all])
  .then(() => true, () => false);
await page.mouse.move(box.x + 0.4 * box.width, box.y + 60);
await page.mouse.down();
await page.mouse.move(box.x + 0.6 * box.width, box.y + 60, { steps: 4 });
await page.mouse.up();
facts.zooms = await shows(false);
await chart.dblclick();
facts.zoomsBack = await shows(true);
await page.locator("#slow .go").first().click();
facts.slowest = { ...(await chosen()), row: await text("#slow .go >> nth=0") };
const scene = page.locator("#path .scene");
await scene.scrollIntoViewIfNeeded();
facts.found = await page.evaluate(async () => {
  const over = document.querySelector("#path .scene canvas:last-of-type"), tip = document.querySelector("#path .tip");
  const area = over.getBoundingClientRect();
  for (let n = 1; n < 400; n += 1) {
    const clientX = area.left + (area.width * ((n * 0.618) % 1)), clientY = area.top + (area.height * ((n * 0.381) % 1));
    over.dispatchEvent(new PointerEvent("pointermove", { clientX, clientY, bubbles: true, buttons: 0 }));
    if (tip.hidden || !tip.textContent) continue;
    const found = { tip: tip.firstChild.textContent, told: document.getElementById("first-told").textContent };
    over.dispatchEvent(new PointerEvent("pointerleave"));
    return found;
  }
  return null;
});

// Keys: play, pause, to the start.
await page.evaluate(() => document.activeElement.blur());
await page.keyboard.press("Home");
await page.selectOption("#player select", "10");
await page.evaluate(() => document.activeElement.blur());
await page.keyboard.press(" ");
await page.waitForFunction(() => parseFloat(document.querySelector("#player .clock").textContent.split(":")[1]) > 1);
await page.keyboard.press(" ");
facts.clock = [await text("#player .clock")];
await settled();
facts.clock.push(await text("#player .clock"));
await page.keyboard.press("Home");

// The controller of today beside the plan: that of the machine file, with its settings and their sources.
const beside = async (words) => {
  await page.waitForFunction((text) => document.getElementById("second-name").textContent.includes(text) && document.getElementById("progress").hidden, words);
  await settled();
};
const settings = () => page.locator("#today-settings tr").evaluateAll((rows) => rows.map((row) => [row.querySelector("input").name, row.querySelector("input").value, row.lastChild.textContent]));
facts.offered = await page.locator("#today option").allTextContents();
await page.selectOption("#today", "grbl");
await beside("grbl (machine file)");
facts.today = { figures: await text("#figures"), name: await text("#second-name"), path: await coloured("#second-path canvas"), first: await coloured("#path canvas") };
facts.today.settings = await settings();
facts.today.options = (await jobs())[0].options;
await page.evaluate(() => scrollTo(0, 0));
await picture("compared");
await page.locator("#today-settings input[name=junction_deviation]").fill("0.5");
await page.locator("#today-settings input[name=junction_deviation]").press("Tab");
await page.waitForFunction(() => document.getElementById("progress").hidden);
facts.otherSettings = await settings();
facts.otherOptions = (await jobs())[0].options;

// Another feed by the slider.
await page.locator("#what-if input[name=feed]").fill("40");
await page.waitForFunction(() => / [−+]?.*%/.test(document.querySelector("#what-if .told").textContent) && !document.querySelector("#what-if .told").textContent.includes("…"));
await settled();
facts.whatIf = { told: await text("#what-if .told"), figures: await text("#figures"), legend: await text("#speed .u-legend") };
await page.click("#what-if button");
facts.asPlanned = await page.locator("#second").isHidden();

// Downloads.
facts.downloads = [];
for (const id of ["save-setpoints", "save-report", "save-program"]) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(`#${id}`)]);
  await download.saveAs(join(folder, download.suggestedFilename()));
  facts.downloads.push(download.suggestedFilename());
}

if (PICTURES) {
  await page.emulateMedia({ colorScheme: "dark" });
  await settled();
  await picture("dark");
  await page.emulateMedia({ colorScheme: "light" });
}

// On a tablet nothing is wider than the page.
await page.setViewportSize(TABLET);
await settled();
await picture("tablet");
facts.tooWide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
await browser.close();
writeFileSync(join(folder, "facts.json"), JSON.stringify(facts, null, 1));
