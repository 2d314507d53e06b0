/* The time [s] that all views of a run point at. */

export class Cursor {
  #listeners = new Set();
  time = null;

  /* Sets the time; `from` is the view that sets it. */
  set(time, from = null) {
    if (time === this.time) return;
    this.time = time;
    for (const listener of this.#listeners) listener(time, from);
  }

  /* Calls `listener(time, from)` after each change; returns a function that removes the listener. */
  follow(listener) {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  }
}
