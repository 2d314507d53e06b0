/* Requests to the service. The user is asked once for its token, which is kept while the tab is open. */

import { element } from "../parts.js";

const KEPT = "feedplan-token";

/* A refusal by the service, with its sentence; `line` is a line of the program or null. */
export class Refused extends Error {
  constructor(problem) {
    super(problem.detail ?? problem.title ?? "the service gave no answer");
    Object.assign(this, { line: problem.line ?? null, status: problem.status });
  }
}

/* The answer to a request; asks the user for the token if it is missing or wrong. Raises Refused. */
export async function request(address, options = {}) {
  for (;;) {
    const token = sessionStorage.getItem(KEPT);
    const headers = { ...options.headers, ...(token ? { Authorization: `Bearer ${token}` } : {}) };
    // With "omit" the browser does not open its own window for a password.
    const answer = await fetch(address, { ...options, headers, credentials: "omit" });
    if (answer.status === 401) {
      await askToken(Boolean(token));
      continue;
    }
    if (!answer.ok) throw new Refused(await answer.json().catch(() => ({ title: `${answer.status} ${answer.statusText}` })));
    return answer;
  }
}

export const json = async (address, options) => (await request(address, options)).json();

/* Saves the answer to a GET request as a file. */
export async function download(address, name) {
  const url = URL.createObjectURL(await (await request(address)).blob());
  const link = element("a");
  Object.assign(link, { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

let asking = null;

/* Asks the user for the token; requests that need it at the same time share one dialog. */
function askToken(wasWrong) {
  asking ??= new Promise((resolve) => {
    const dialog = element("dialog");
    const form = dialog.appendChild(element("form"));
    form.method = "dialog";
    const label = form.appendChild(element("label", "", wasWrong ? "This token is wrong. Token of the service" : "Token of the service"));
    const input = label.appendChild(element("input"));
    Object.assign(input, { type: "password", autocomplete: "current-password", required: true });
    const button = form.appendChild(element("button", "main", "Go on"));
    button.type = "submit";
    dialog.addEventListener("cancel", (event) => event.preventDefault());
    dialog.addEventListener("close", () => {
      sessionStorage.setItem(KEPT, input.value.trim());
      dialog.remove();
      asking = null;
      resolve();
    });
    document.body.append(dialog);
    dialog.showModal();
  });
  return asking;
}

/* Server-sent events of an address as [kind, data]; after a broken connection it continues with the next event. */
export async function* events(address, signal) {
  let last = "";
  for (let failures = 0; failures < 20; ) {
    try {
      const answer = await request(address, { signal, headers: last ? { "Last-Event-ID": last } : {} });
      if (answer.status === 204) return;
      let rest = "", kind = "message";
      for await (const part of texts(answer.body)) {
        const lines = (rest + part).split("\n");
        rest = lines.pop();
        failures = 0;
        for (const line of lines) {
          if (line.startsWith("id: ")) last = line.slice(4);
          if (line.startsWith("event: ")) kind = line.slice(7);
          if (line.startsWith("data: ")) yield [kind, JSON.parse(line.slice(6))];
        }
      }
      return;
    } catch (error) {
      if (error instanceof Refused || signal?.aborted) throw error;
      failures += 1;
      await new Promise((resolve) => setTimeout(resolve, 1000));
    }
  }
  throw new Refused({ title: "the service cannot be reached: see whether it runs" });
}

async function* texts(stream) {
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  for (let part = await reader.read(); !part.done; part = await reader.read()) yield part.value;
}
