/* One program planned by the service: sent, followed to its end, and read as what is drawn. */

import { unpacked } from "../data.js";
import { Run } from "../run.js";
import { Refused, events, json, request } from "./api.js";

/* An order is { program (a file), name, machine, method, options }. Sends it, tells `onProgress(stage, done)`, and
   gives what `opened` gives. Cancels the job where the signal is aborted. */
export async function planned(order, { onProgress, signal } = {}) {
  const form = new FormData();
  form.append("program", order.program, order.name);
  form.append("machine", order.machine);
  form.append("method", order.method);
  form.append("options", JSON.stringify(order.options));
  // A request that is broken off may have been accepted: its job is known, and cancelled, after the answer alone.
  const job = await json("/v1/jobs", { method: "POST", body: form });
  try {
    signal?.throwIfAborted();
    onProgress?.("waits", 0, job);
    for await (const [kind, data] of events(job.links.events, signal)) {
      if (kind === "progress") onProgress?.(data.stage, data.done, job);
    }
  } catch (error) {
    if (signal?.aborted) request(job.links.cancel, { method: "POST" }).catch(() => {});
    throw error;
  }
  return opened(job.id, order);
}

/* A job that is done: { job, summary (plan.json), data (what is drawn), run, order }. Raises Refused with why it
   has failed. */
export async function opened(id, order = null) {
  const job = await json(`/v1/jobs/${id}`);
  if (job.problem) throw new Refused(job.problem);
  const [summary, drawing, program] = await Promise.all([
    json(job.links.result),
    request(job.links.drawing).then((answer) => answer.arrayBuffer()),
    order?.program ?? request(job.links.program).then((answer) => answer.blob()),
  ]);
  const data = unpacked(drawing);
  const own = { program, name: job.program.name, machine: summary.machine_file, method: job.method, options: job.options };
  return { job, summary, data, run: new Run(data.path), order: own };
}
