/* Plays a run: moves the cursor with time. */

import { clock } from "../numbers.js";
import { element } from "../parts.js";

const PACES = [0.1, 0.25, 0.5, 1, 2, 5, 10, 30, 100, 300];
const STEPS = 4000; // number of positions of the slider

export class Player {
  #frame = 0;
  #last = 0;

  constructor(container, cursor) {
    this.cursor = cursor;
    this.duration = 0;
    this.button = container.appendChild(element("button", "play", "▶"));
    this.button.type = "button";
    this.button.ariaLabel = "Play";
    this.slider = container.appendChild(element("input", "time"));
    Object.assign(this.slider, { type: "range", min: 0, max: STEPS, value: 0, ariaLabel: "Time" });
    this.told = container.appendChild(element("output", "clock"));
    this.pace = container.appendChild(element("select"));
    this.pace.ariaLabel = "Pace";
    for (const pace of PACES) {
      const option = this.pace.appendChild(element("option", "", `${pace}×`));
      option.value = pace;
      option.selected = pace === 1;
    }
    this.button.addEventListener("click", () => this.toggle());
    this.slider.addEventListener("input", () => {
      this.stop();
      cursor.set((this.slider.value / STEPS) * this.duration, "player");
    });
    cursor.follow((time, from) => {
      if (from !== "player") this.stop();
      this.#tell(time);
    });
  }

  /* Sets the duration of the run to play [s]. */
  show(duration) {
    this.stop();
    this.duration = duration;
    this.#tell(null);
  }

  toggle() {
    if (this.#frame) this.stop();
    else this.play();
  }

  play() {
    if (!this.duration) return;
    if (this.cursor.time === null || this.cursor.time >= this.duration) this.cursor.set(0, "player");
    this.#last = performance.now();
    this.button.textContent = "❚❚";
    this.button.ariaLabel = "Pause";
    this.#frame = requestAnimationFrame((now) => this.#step(now));
  }

  stop() {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    this.button.textContent = "▶";
    this.button.ariaLabel = "Play";
  }

  #step(now) {
    const passed = Math.max(0, (now - this.#last) / 1000) * Number(this.pace.value);
    this.#last = now;
    const time = Math.min((this.cursor.time ?? 0) + passed, this.duration);
    if (time >= this.duration) this.stop();
    else this.#frame = requestAnimationFrame((next) => this.#step(next));
    this.cursor.set(time, "player");
  }

  #tell(time) {
    this.slider.value = this.duration > 0 ? ((time ?? 0) / this.duration) * STEPS : 0;
    this.told.textContent = `${clock(time ?? 0)} / ${clock(this.duration)}`;
  }
}
