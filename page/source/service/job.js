/* Has one program planned by the service: sends it, follows its events, and loads the data to draw. */

import { unpacked } from "../data.js";
import { Run } from "../run.js";
import { Refused, events, json, request } from "./api.js";

/* Sends an order { program (a file), name, machine, method, options }, calls `onProgress(stage, done)`, and returns
   the result of `opened`. Cancels the job if the signal is aborted. */
export async function planned(order, { onProgress, signal } = {}) {
  const form = new FormData();
  form.append("program", order.program, order.name);
  form.append("machine", order.machine);
  form.append("method", order.method);
  form.append("options", JSON.stringify(order.options));
  // The request itself is not aborted: the job may be accepted already, and only the answer has its id.
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

/* The result of a job: { job, summary (plan.json), data (of the drawing), run, order }. Raises Refused with the
   reason if the job has failed. */
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
