/* Limits in the text of a machine file (TOML), as the service writes it: read, set and scaled, other lines kept. */

export const LIMITS = { max_velocity: "velocity", max_acceleration: "acceleration", max_jerk: "jerk" };

/* The axes of a text: { name, unit, max_velocity, … } with values as they are written, undefined where missing. */
export function axesOf(text) {
  return blocks(text).map((block) => {
    const axis = { name: read(block, "name")?.replaceAll('"', ""), kind: read(block, "kind")?.replaceAll('"', ""), unit: read(block, "unit")?.replaceAll('"', "") };
    axis.unit ??= axis.kind === "rotary" || "ABC".includes(axis.name) ? "deg" : "mm";
    for (const key of Object.keys(LIMITS)) axis[key] = read(block, key);
    return axis;
  });
}

/* The text with a limit of an axis as `value`, a text; the line is left out where it is empty. */
export function withLimit(text, axis, key, value) {
  return changed(text, axis, (block) => written(block, key, value));
}

/* The text with a limit of an axis times a factor, in both directions where these differ. */
export function scaled(text, axis, key, factor) {
  const times = (value) => value.replace(/[\d.]+(?:e[-+]?\d+)?/gi, (number) => String(Number((Number(number) * factor).toPrecision(9))));
  return changed(text, axis, (block) => {
    const value = read(block, key);
    return value === undefined ? block : written(block, key, times(value));
  });
}

const HEAD = "[[axes]]";
const blocks = (text) => text.split(HEAD).slice(1);
const pattern = (key) => new RegExp(`^${key}[ \\t]*=[ \\t]*([^#\\n]*?)[ \\t]*(#.*)?$`, "m");
const read = (block, key) => pattern(key).exec(block)?.[1];

function written(block, key, value) {
  const line = `${key} = ${value}`;
  if (pattern(key).test(block)) return block.replace(pattern(key), value === "" ? "" : line);
  return value === "" ? block : block.replace(pattern("name"), (name) => `${name}\n${line}`);
}

function changed(text, axis, change) {
  const [head, ...rest] = text.split(HEAD);
  return [head, ...rest.map((block) => (read(block, "name") === `"${axis}"` ? change(block) : block))].join(HEAD);
}
