/* Touch on a chart: one finger sets the cursor, two fingers zoom and move. The page still scrolls vertically. */

/* A plugin of uPlot that calls `zoom(range)` and `point(x)`; `ends()` gives the ends of the whole axis. */
export function touch(zoom, ends, point) {
  return {
    hooks: {
      ready: (u) => {
        let held = null;
        const { over } = u;
        over.style.touchAction = "pan-y";
        const places = (event) => [...event.touches].slice(0, 2).map((one) => one.clientX - over.getBoundingClientRect().left);
        over.addEventListener("touchstart", (event) => {
          held = event.touches.length === 2 ? places(event).map((left) => u.posToVal(left, "x")) : null;
        }, { passive: true });
        over.addEventListener("touchmove", (event) => {
          const at = places(event);
          if (!held || at.length < 2) return point(u.posToVal(at[0], "x"));
          event.preventDefault();
          u.pinched = ranged(held, at, u.bbox.width / devicePixelRatio, ends());
        }, { passive: false });
        over.addEventListener("touchend", () => {
          if (u.pinched) zoom(u.pinched);
          held = u.pinched = null;
        });
      },
    },
  };
}

/* The range of an axis of `width` pixels on which the values `held` are at the pixels `at`, within first and last. */
function ranged(held, at, width, [first, last]) {
  if (Math.abs(at[1] - at[0]) < 10) return null;
  const scale = (held[1] - held[0]) / (at[1] - at[0]);
  const from = held[0] - at[0] * scale;
  const range = [Math.max(first, from), Math.min(last, from + width * scale)];
  return range[1] > range[0] ? range : null;
}
