/* Builds the script and the style of all pages, into the Python package. */

import { readFileSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const FOLDER = "../feedplan/report/bundle";
const PACKAGES = ["three", "uplot"];

await build({
  absWorkingDir: import.meta.dirname,
  entryPoints: { page: "source/main.js" },
  outdir: FOLDER,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  charset: "ascii",
  legalComments: "none",
  banner: { js: "/* With three.js (three.js authors) and uPlot (Leon Sorokin), both under the MIT licence. */" },
  logLevel: "warning",
});

const here = (path) => new URL(path, import.meta.url);
const licences = PACKAGES.map((name) => `${name}\n\n${readFileSync(here(`node_modules/${name}/LICENSE`), "utf8").trim()}\n`);
writeFileSync(here(`${FOLDER}/LICENCES`), licences.join("\n\n"));
