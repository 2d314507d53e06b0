/* Colours of the page, light or dark, as the style sheet has them; on paper it is always light. */

const root = document.documentElement;
const dark = matchMedia("(prefers-color-scheme: dark)");
const listeners = new Set();

// Asking the browser makes it lay out the page, so it is asked once for each name.
const known = new Map();

export function style(name) {
  if (!known.has(name)) known.set(name, getComputedStyle(document.body).getPropertyValue(name).trim());
  return known.get(name);
}

/* The font of drawn texts of so many pixels. */
export const font = (pixels) => `${pixels}px ${style("font-family")}`;

/* A colour of the style sheet, given as #rrggbb, with an opacity. */
export function wash(name, alpha) {
  return `rgba(${channels(style(name)).join(",")},${alpha})`;
}

/* Red, green and blue, 0 to 255, of #rrggbb. */
export const channels = (colour) => [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16));

/* The colour of the k-th axis, told apart by those who see no red or no green as well. */
export const axisColour = (k) => style(`--axis-${k % 9}`);

export const isDark = () => dark.matches && !root.classList.contains("printing");

/* Called after the colours have changed, with whether the page is being printed. */
export const onTheme = (listener) => listeners.add(listener);

function tell(printing) {
  root.classList.toggle("printing", printing);
  known.clear();
  for (const listener of listeners) listener(printing);
}

dark.addEventListener("change", () => tell(false));
addEventListener("beforeprint", () => tell(true));
addEventListener("afterprint", () => tell(false));
