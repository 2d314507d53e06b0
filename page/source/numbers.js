/* Numbers as text: four digits, with a space between thousands. */

const NARROW_SPACE = "\u202f";

export function shown(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const [whole, rest] = String(Number(value.toPrecision(digits))).split(".");
  if (whole.includes("e")) return whole;
  const apart = whole.replace(/\B(?=(\d{3})+$)/g, NARROW_SPACE).replace("-", "−");
  return rest ? `${apart}.${rest}` : apart;
}

/* A number beside a chart; with an exponent if it would have more than eight characters without its sign. */
export function tick(value) {
  const text = shown(value, 6);
  return text.replace("−", "").length <= 8 ? text : Number(value.toPrecision(6)).toExponential().replace(/^-/, "−").replace("+", "");
}

/* A time [s] as text with units. */
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  if (Math.abs(seconds) < 1) return `${shown(seconds * 1e3)} ms`;
  if (Math.abs(seconds) < 60) return `${seconds.toFixed(3)} s`;
  // Rounded before the division, so that 119.97 s give 2 min 0.0 s.
  const tenths = Math.round(10 * seconds);
  const whole = Math.floor(tenths / 600);
  const rest = `${((tenths - 600 * whole) / 10).toFixed(1)} s`;
  return whole < 60 ? `${whole} min ${rest}` : `${Math.floor(whole / 60)} h ${whole % 60} min ${rest}`;
}

/* A time [s] as a clock: 1:02.345. */
export function clock(seconds) {
  const thousandths = Math.round(1e3 * seconds);
  const minutes = Math.floor(thousandths / 6e4);
  return `${minutes}:${((thousandths - 6e4 * minutes) / 1e3).toFixed(3).padStart(6, "0")}`;
}

/* The number in a text, or the list of several that are separated by commas; null for an empty text. Text that is no
   number is returned unchanged, and the service refuses it. */
export function numbersIn(text) {
  const values = text.split(",").map((part) => part.trim()).filter(Boolean).map((part) => (Number.isNaN(Number(part)) ? part : Number(part)));
  return values.length > 1 ? values : values[0] ?? null;
}

/* The least and the greatest value; [0, 0] without values. */
export function extent(values) {
  let low = Infinity, high = -Infinity;
  for (let i = 0; i < values.length; i += 1) {
    if (values[i] < low) low = values[i];
    if (values[i] > high) high = values[i];
  }
  return low <= high ? [low, high] : [0, 0];
}

/* The index of the last element of a sorted list that is at most the value; 0 if there is none. */
export function lastUpTo(list, value) {
  let low = 0, high = list.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (list[middle] <= value) low = middle;
    else high = middle - 1;
  }
  return Math.max(low, 0);
}
