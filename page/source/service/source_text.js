/* The source of the program, of any length: only the lines in view are elements of the page. */

import { element } from "../parts.js";

const ROW = 19; // height of a line in pixels
const LINES = 1 << 17; // lines that are found between two reactions to the user
const MOST = 12_000_000; // greatest height that browsers can scroll, in pixels

export class SourceText {
  #bytes = new Uint8Array(0);
  #starts = [0];
  #chosen = 0;

  /* `onLine(number)` gets the number of the line that was clicked. */
  constructor(container, onLine) {
    this.container = container;
    this.room = container.appendChild(element("div", "room"));
    this.lines = this.room.appendChild(element("div", "lines"));
    container.addEventListener("scroll", () => this.#draw());
    this.lines.addEventListener("click", ({ target }) => {
      const line = target.closest("[data-line]")?.dataset.line;
      if (line) onLine(Number(line));
    });
    new ResizeObserver(() => this.#draw()).observe(container);
  }

  /* Shows a program (a Blob); if `hasLines` is false, no line is ever marked. */
  async show(blob, hasLines = true) {
    this.hasLines = hasLines;
    const bytes = new Uint8Array(await blob.arrayBuffer()), starts = [0];
    this.#bytes = bytes;
    // Lines end with LF, CR LF or CR.
    for (let at = 0; at < bytes.length; at += 1) {
      if (bytes[at] !== 10 && (bytes[at] !== 13 || bytes[at + 1] === 10)) continue;
      starts.push(at + 1);
      if (starts.length % LINES === 0) await new Promise((resolve) => setTimeout(resolve)); // lets the page react
      if (this.#bytes !== bytes) return; // another program is shown
    }
    this.#starts = starts;
    this.room.style.height = `${Math.min(starts.length * ROW, MOST)}px`;
    this.container.scrollTop = 0;
    this.choose(0);
  }

  text(line) {
    const end = this.#starts[line] ?? this.#bytes.length;
    return new TextDecoder().decode(this.#bytes.subarray(this.#starts[line - 1], Math.min(end, this.#starts[line - 1] + 400))).trimEnd();
  }

  /* Marks a line (from 1, 0 for none) and scrolls it into view. */
  choose(number) {
    const line = this.hasLines ? number : 0;
    if (line === this.#chosen && line) return;
    this.#chosen = line;
    const first = this.#first(), shown = Math.floor(this.container.clientHeight / ROW);
    if (line && (line < first + 2 || line > first + shown - 2)) {
      this.container.scrollTop = Math.max(0, (line - shown / 3) * ROW * this.#scale());
    }
    this.#draw();
  }

  #scale() {
    return Math.min(1, MOST / (this.#starts.length * ROW));
  }

  #first() {
    return Math.floor(this.container.scrollTop / (ROW * this.#scale()));
  }

  #draw() {
    const first = this.#first();
    const last = Math.min(this.#starts.length, first + Math.ceil(this.container.clientHeight / ROW) + 2);
    this.lines.style.transform = `translateY(${this.#scale() < 1 ? this.container.scrollTop : first * ROW}px)`;
    const rows = [];
    for (let line = first + 1; line <= last; line += 1) {
      const row = element("div", line === this.#chosen ? "line chosen" : "line");
      row.dataset.line = line;
      row.append(element("i", "", `${line}`), this.text(line));
      rows.push(row);
    }
    this.lines.replaceChildren(...rows);
  }
}
