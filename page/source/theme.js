/* The colours of the page from the style sheet, light or dark; printed pages are light. */

const root = document.documentElement;
const dark = matchMedia("(prefers-color-scheme: dark)");
const listeners = new Set();

// Each colour is read once, because reading makes the browser lay out the page.
const known = new Map();

export function style(name) {
  if (!known.has(name)) known.set(name, getComputedStyle(document.body).getPropertyValue(name).trim());
  return known.get(name);
}

/* The font for texts on a canvas, of a size in pixels. */
export const font = (pixels) => `${pixels}px ${style("font-family")}`;

/* A colour #rrggbb of the style sheet with an opacity. */
export function wash(name, alpha) {
  return `rgba(${channels(style(name)).join(",")},${alpha})`;
}

/* Red, green and blue, 0 to 255, of a colour #rrggbb. */
export const channels = (colour) => [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));

/* The colour of the k-th axis; the colours can be told apart without red and green. */
export const axisColour = (k) => style(`--axis-${k % 9}`);

export const isDark = () => dark.matches && !root.classList.contains("printing");

/* Calls the function after each change of the colours; its argument is true while the page is printed. */
export const onTheme = (listener) => listeners.add(listener);

function tell(printing) {
  root.classList.toggle("printing", printing);
  known.clear();
  for (const listener of listeners) listener(printing);
}

dark.addEventListener("change", () => tell(false));
addEventListener("beforeprint", () => tell(true));
addEventListener("afterprint", () => tell(false));
