/* The page of the service: accepts a program, has it planned, and shows and compares plans. */

import "./service.css";

import { duration, numbersIn } from "../numbers.js";
import { element } from "../parts.js";
import { json } from "./api.js";
import { opened, planned } from "./job.js";
import { keys } from "./keys.js";
import { MachineChoice } from "./machine.js";
import { Result } from "./result.js";
import { Today } from "./today.js";
import { WhatIf } from "./what_if.js";

const RECENT = 12;

export async function service() {
  const at = (id) => document.getElementById(id);
  const machine = new MachineChoice(at("machine"), at("axes-table"), at("machine-text"), at("machine-told"));
  const result = new Result(at);
  const whatIf = new WhatIf(at("what-if"), (plan, words) => {
    today.clear();
    result.beside(plan, words);
  });
  const today = new Today(at("today"), at("today-settings"), async () => {
    whatIf.quiet();
    const chosen = today.order;
    if (!chosen) return result.beside(null);
    const made = await plan(chosen.order);
    if (made) result.beside(made, chosen.words);
    else if (!at("failure").hidden) result.beside(null);
  });
  let program = null, stop = null;

  keys(result, at("help"));
  at("show-help").addEventListener("click", () => at("help").showModal());
  at("close-help").addEventListener("click", () => at("help").close());

  function take(file) {
    program = file;
    at("program-name").textContent = `${file.name}, ${(file.size / 1e3).toFixed(file.size < 1e4 ? 1 : 0)} kB`;
    at("plan").disabled = false;
  }

  /* The options that the user has given. */
  function options() {
    const given = ["tolerance", "feed"].map((name) => [name, numbersIn(at(name).value)]);
    return Object.fromEntries(given.filter(([, value]) => value !== null));
  }

  /* Plans and shows the progress; shows an error and returns null if the job was stopped or refused. */
  async function plan(order) {
    stop?.abort();
    const own = (stop = new AbortController());
    at("failure").hidden = true;
    at("progress").hidden = false;
    tell("sends", 0);
    try {
      return await planned(order, { onProgress: tell, signal: own.signal });
    } catch (error) {
      if (!own.signal.aborted) fail(error);
      return null;
    } finally {
      if (stop === own) at("progress").hidden = true;
    }
  }

  function tell(stage, done) {
    at("bar").value = done;
    at("stage").textContent = `${stage} … ${Math.round(100 * done)} %`;
  }

  function fail(error) {
    at("failure").hidden = false;
    at("failure").textContent = error.message;
  }

  function show(made) {
    at("hint").hidden = true;
    result.show(made);
    for (const part of [whatIf, today]) part.show(made).catch(fail);
    document.title = `${made.order.name} – feedplan`;
    recent();
  }

  async function start() {
    const made = await plan({ program, name: program.name, machine: machine.order, method: at("method").value, options: options() });
    if (made) show(made);
  }

  let older = null; // `before` of the request for older plans

  /* Lists the newest plans, or adds older ones to the list. */
  async function recent(before = null) {
    const { jobs, before: next } = await json(`/v1/jobs?state=done&count=${RECENT}${before === null ? "" : `&before=${before}`}`);
    older = next;
    at("older").hidden = next === null;
    if (before === null) at("recent").replaceChildren();
    at("recent").append(...jobs.map((job) => {
      const button = element("button");
      button.type = "button";
      button.append(element("b", "", job.program.name), element("span", "", `${job.method} · ${job.machine} · ${duration(job.result.time)}`));
      button.addEventListener("click", async () => {
        try {
          const made = await opened(job.id);
          take(new File([made.order.program], made.order.name));
          at("method").value = made.order.method;
          machine.take(made.order.machine);
          show(made);
        } catch (error) {
          fail(error);
        }
      });
      const item = element("li");
      item.append(button);
      return item;
    }));
  }

  // A program is chosen by a dialog or dropped anywhere on the page.
  at("file").addEventListener("change", () => {
    if (!at("file").files.length) return;
    take(at("file").files[0]);
    start();
  });
  addEventListener("dragover", (event) => {
    event.preventDefault();
    document.body.classList.add("dropping");
  });
  addEventListener("dragleave", (event) => event.relatedTarget === null && document.body.classList.remove("dropping"));
  addEventListener("drop", (event) => {
    event.preventDefault();
    document.body.classList.remove("dropping");
    if (!event.dataTransfer.files.length) return;
    take(event.dataTransfer.files[0]);
    start();
  });
  at("plan").addEventListener("click", start);
  at("older").addEventListener("click", () => recent(older).catch(fail));
  at("cancel").addEventListener("click", () => stop?.abort());

  try {
    await machine.load();
    const { methods } = await json("/v1/methods");
    for (const { name } of methods) at("method").append(new Option(name, name, false, name === "bang-bang"));
    await today.load();
    await recent();
  } catch (error) {
    fail(error);
  }
  document.body.dataset.ready = "yes";
}
