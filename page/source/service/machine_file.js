/* Asks the service for the description of a machine: its axes, its controller, the whole text of its file. */

import { json } from "./api.js";

export const LIMITS = { max_velocity: "velocity", max_acceleration: "acceleration", max_jerk: "jerk" };

/* The machine of a name or of a file's text, with changed limits { axis: { key: value } }. Raises Refused with the
   error in the text. */
export function described(machine, limits = {}) {
  const body = JSON.stringify({ machine, limits });
  return json("/v1/machines", { method: "POST", body, headers: { "Content-Type": "application/json" } });
}

/* A limit as text: empty if there is none, two numbers if the directions differ. */
export const written = (limit) => (limit === null ? "" : [limit].flat().join(", "));

/* A limit times a factor, in both directions. */
export function scaled(limit, factor) {
  const times = (value) => Number((value * factor).toPrecision(9));
  return Array.isArray(limit) ? limit.map(times) : times(limit);
}
