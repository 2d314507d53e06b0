/* The keys of the page. */

import { PathView } from "../path_view.js";

const FEW = 0.002, MANY = 0.02; // steps as shares of the whole time

export function keys(result, help) {
  const { cursor, player, path } = result;
  const step = (part) => cursor.set(Math.min(Math.max((cursor.time ?? 0) + part * player.duration, 0), player.duration), "player");
  const next = (names, name) => names[(names.indexOf(name) + 1) % names.length];
  const actions = {
    " ": () => player.toggle(),
    ArrowLeft: (event) => step(event.shiftKey ? -MANY : -FEW),
    ArrowRight: (event) => step(event.shiftKey ? MANY : FEW),
    Home: () => cursor.set(0, "player"),
    End: () => cursor.set(player.duration, "player"),
    v: () => path.look(next(PathView.views, path.scene.view)),
    c: () => path.colour(next(PathView.modes, path.modeName)),
    "+": () => path.scene.zoomBy(1.25),
    "-": () => path.scene.zoomBy(0.8),
    "?": () => (help.open ? help.close() : help.showModal()),
  };
  addEventListener("keydown", (event) => {
    const isTyping = event.target.closest("input, select, textarea, dialog") || (event.key === " " && event.target.closest("button, summary, a"));
    if (!result.plan || isTyping || event.ctrlKey || event.metaKey || event.altKey || !actions[event.key]) return;
    event.preventDefault();
    actions[event.key](event);
  });
}
