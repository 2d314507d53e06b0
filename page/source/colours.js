/* Colour scales: viridis and cividis (matplotlib, both readable without red or green), and a set of colours for
   kinds (eight of Okabe and Ito 2008, then Tol's muted ones). */

import { channels, isDark } from "./theme.js";

const VIRIDIS = "440154 482475 414487 355f8d 2a788e 21918c 22a884 44bf70 7ad151 bddf26 fde725";
const CIVIDIS = "00224e 123570 3b496c 575d6d 707173 8a8678 a59c74 c3b369 e1cc55 fee838";
const KINDS = "0072b2 e69f00 009e73 d55e00 cc79a7 56b4e9 8c8c00 882255 44aa99 999933 aa4499 6f6f6f 332288 117733 ddcc77";

const listed = (text) => text.split(" ").map((colour) => channels(`#${colour}`));
const SCALES = { viridis: listed(VIRIDIS), cividis: listed(CIVIDIS) };
const kinds = listed(KINDS);

/* Leaves out the end of a scale that is hardly visible on the background. */
const part = (at) => (isDark() ? 0.12 + 0.88 * at : 0.9 * at);

/* The colour of a value from 0 to 1 on a scale: red, green and blue, 0 to 255. */
export function mixed(scale, value) {
  const colours = SCALES[scale];
  const at = part(Math.min(Math.max(value, 0), 1)) * (colours.length - 1);
  const i = Math.min(Math.floor(at), colours.length - 2);
  return [0, 1, 2].map((k) => Math.round(colours[i][k] + (at - i) * (colours[i + 1][k] - colours[i][k])));
}

/* The colour of a kind by its number; the last of `count` kinds, "no limit active", is grey. */
export const kindColour = (k, count) => (k === count - 1 ? [140, 140, 140] : kinds[k % kinds.length]);

export const css = ([r, g, b]) => `rgb(${r},${g},${b})`;

/* A scale as a CSS gradient. */
export const gradient = (scale) => `linear-gradient(90deg, ${[0, 0.25, 0.5, 0.75, 1].map((at) => css(mixed(scale, at))).join(", ")})`;
