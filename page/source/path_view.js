/* The tool path with buttons for view and colour mode, and with the legend of the colours. */

import { gradient } from "./colours.js";
import { MODES, told } from "./modes.js";
import { choice, element } from "./parts.js";
import { PathScene } from "./scene.js";
import { onTheme } from "./theme.js";

const VIEW_NAMES = { xyz: "3D", xy: "Top", xz: "Front", yz: "Side" };

export class PathView {
  /* Fills `container`; `tools` gets the buttons; `onChoice` is called when a view or a colour mode is chosen. */
  constructor(container, tools, cursor, { onMove, onChoice } = {}) {
    Object.assign(this, { cursor, onChoice });
    this.box = container.appendChild(element("div", "path"));
    this.legend = container.appendChild(element("div", "legend"));
    this.tip = this.box.appendChild(element("div", "tip"));
    this.scene = new PathScene(this.box, { onHover: (i, event) => this.#hover(i, event), onMove });
    this.modeName = "speed";
    if (tools) {
      this.modes = choice(Object.fromEntries(Object.entries(MODES).map(([name, { label }]) => [name, label])), "Colours", (name) => this.colour(name));
      this.views = choice(VIEW_NAMES, "View of the tool path", (name) => this.look(name));
      tools.append(this.modes.box, this.views.box);
    }
    cursor.follow((time, from) => this.scene.mark(time, from === "player" && time > 0));
    onTheme(() => this.run && this.#showLegend());
  }

  /* Shows a run in the chosen view and colours. */
  show(run) {
    const isFirst = !this.run;
    const view = this.scene.view;
    this.run = run;
    this.mode = MODES[this.modeName].of(run.path);
    this.scene.mark(this.cursor.time);
    this.scene.show(run, this.mode);
    if (!isFirst && view !== this.scene.view && view !== "xyz") this.scene.look(view);
    this.views?.press(this.scene.view);
    this.modes?.press(this.modeName);
    this.#showLegend();
  }

  look(name) {
    this.scene.look(name);
    this.views?.press(name);
    this.onChoice?.();
  }

  colour(name) {
    this.modeName = name;
    this.modes?.press(name);
    this.mode = MODES[name].of(this.run.path);
    this.scene.colour(this.mode);
    this.#showLegend();
    this.onChoice?.();
  }

  /* The names of colour modes and of views, for the keys. */
  static modes = Object.keys(MODES);
  static views = Object.keys(VIEW_NAMES);

  #showLegend() {
    const { scale, ends, kinds, note } = this.mode;
    if (kinds) {
      this.legend.replaceChildren(...kinds.map(({ name, colour }) => {
        const entry = element("span", "kind-of", name);
        const patch = element("i", "patch");
        patch.style.background = colour;
        entry.prepend(patch);
        return entry;
      }));
      return;
    }
    const bar = element("i", "bar-of");
    bar.style.background = gradient(scale);
    this.legend.replaceChildren(element("span", "", ends[0]), bar, element("span", "", ends[1]), element("span", "", note ?? ""));
  }

  #hover(i, event) {
    this.tip.hidden = i < 0;
    if (i < 0) return;
    const { path } = this.run;
    this.cursor.set(path.time[i], this);
    this.tip.replaceChildren(...told(path, i).map((line) => element("div", "", line)));
    const box = this.box.getBoundingClientRect();
    const left = event.clientX - box.left, top = event.clientY - box.top;
    this.tip.style.transform = `translate(${Math.min(left + 14, box.width - this.tip.offsetWidth - 4)}px, ${Math.min(top + 14, box.height - this.tip.offsetHeight - 4)}px)`;
  }
}
