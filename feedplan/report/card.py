"""Shows a plan as a small HTML table and its speed over time as SVG, for notebooks; needs no other
package."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

import numpy as np

from feedplan.trajectory import Trajectory

WIDTH, HEIGHT, MARGIN = 480, 120, 24
# Number of times at which the speed is drawn: two for each pixel.
SAMPLES = 2 * WIDTH


def card(figures: Mapping[str, str], trajectory: Trajectory) -> str:
    """`figures` as rows of a table, and below them the tool's speed over the time [s]."""
    rows = "".join(
        f'<tr><th style="text-align:left">{escape(name)}</th>'
        f'<td style="text-align:left">{escape(value)}</td></tr>'
        for name, value in figures.items()
    )
    return f"<table>{rows}</table>{_speed(trajectory)}"


def _speed(trajectory: Trajectory) -> str:
    if not trajectory.duration > 0:
        return ""
    t = np.linspace(0.0, trajectory.duration, SAMPLES)
    speed = trajectory.speed(trajectory.distance(t))
    most = float(speed.max())
    if not most > 0:
        return ""
    x = MARGIN + (WIDTH - 2 * MARGIN) * t / trajectory.duration
    y = HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * speed / most
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    base = HEIGHT - MARGIN
    text = 'font-family="sans-serif" font-size="11" fill="currentColor"'
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" role="img" '
        'aria-label="speed over time">'
        f'<path d="M{MARGIN},{base}H{WIDTH - MARGIN}" stroke="currentColor" stroke-width="0.5"/>'
        f'<polyline points="{points}" fill="none" stroke="#0072b2" stroke-width="1.5"/>'
        f'<text x="{MARGIN}" y="{MARGIN - 8}" {text}>'
        f"speed, up to {most:.4g} {escape(trajectory.unit)}/s</text>"
        f'<text x="{WIDTH - MARGIN}" y="{HEIGHT - 6}" text-anchor="end" {text}>'
        f"{trajectory.duration:.4g} s</text></svg>"
    )
