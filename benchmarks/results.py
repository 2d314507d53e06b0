"""The result of a benchmark: a table that is shown, stored as JSON and drawn as a chart."""

from __future__ import annotations

import json
import math
import os
import platform
from dataclasses import dataclass
from html import escape
from importlib import metadata
from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape as as_markup
from rich.table import Table

Cell = float | int | str


@dataclass(frozen=True)
class Chart:
    """The columns of a chart with logarithmic scales: `x`, `y`, `series` (one colour for each value) and the
    `label` of a point."""

    x: str
    y: str
    series: str
    label: str


@dataclass(frozen=True)
class Result:
    """One table: `rows` map column names to numbers or words; `notes` are sentences below it."""

    name: str
    title: str
    rows: tuple[dict[str, Cell], ...]
    notes: tuple[str, ...] = ()
    chart: Chart | None = None


def show(result: Result, console: Console) -> None:
    """Prints the table."""
    table = Table(
        title=result.title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False
    )
    columns = list(dict.fromkeys(column for row in result.rows for column in row))
    for column in columns:
        words = isinstance(result.rows[0].get(column), str)
        # Columns of sentences are wrapped, columns of numbers are not.
        table.add_column(as_markup(column), justify="left" if words else "right", no_wrap=not words)
    for row in result.rows:
        table.add_row(*(_written(row[column]) if column in row else "" for column in columns))
    console.print(table)
    for note in result.notes:
        console.print(f"  {note}", highlight=False)
    console.print()


def store(result: Result, directory: Path) -> Path:
    """Writes the table and the computer that it was made on as JSON; returns the path of the file."""
    directory.mkdir(parents=True, exist_ok=True)
    packages = {name: metadata.version(name) for name in ("feedplan", "numpy")}
    content = {
        "name": result.name,
        "title": result.title,
        "rows": result.rows,
        "notes": result.notes,
        "computer": {"processor": _processor(), "cores": os.cpu_count(), "system": platform.platform()},
        "versions": {"python": platform.python_version(), **packages},
    }
    path = directory / f"{result.name}.json"
    partial = path.with_suffix(".partial")
    partial.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    partial.replace(path)
    return path


def draw(result: Result, directory: Path) -> Path | None:
    """Writes the chart as a picture (SVG); returns its path, None without a chart."""
    if result.chart is None:
        return None
    path = directory / f"{result.name}.svg"
    path.write_text(_scatter(result, result.chart), encoding="utf-8")
    return path


# Width and height of the picture, the margins of its field, and colours that differ without red or green.
_SIZE, _ROOM = (960, 600), (80, 220, 50, 60)  # left, right, above, below
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#332288", "#882255", "#666666")


def _scatter(result: Result, chart: Chart) -> str:
    """Points on logarithmic scales with lines at powers of ten; the pointer shows the label of a point."""
    rows = [row for row in result.rows if _is_positive(row[chart.x]) and _is_positive(row[chart.y])]
    left, right, above, below = _ROOM
    spans = []
    for column in (chart.x, chart.y):
        powers = [math.log10(float(row[column])) for row in rows] or [0.0]
        spans.append((math.floor(min(powers)), max(math.ceil(max(powers)), math.floor(min(powers)) + 1)))

    def place(axis: int, power: float) -> float:
        low, high = spans[axis]
        part = (power - low) / (high - low)
        if axis == 0:
            return left + part * (_SIZE[0] - left - right)
        return _SIZE[1] - below - part * (_SIZE[1] - above - below)

    bottom, top, end = _SIZE[1] - below, above, _SIZE[0] - right
    parts = [f'<text x="{left}" y="28" font-size="16">{escape(result.title)}</text>']
    for power in range(spans[0][0], spans[0][1] + 1):
        x = place(0, power)
        parts.append(f'<path d="M{x:.1f},{top}V{bottom}" stroke="#ddd"/>')
        parts.append(f'<text x="{x:.1f}" y="{bottom + 18}" text-anchor="middle">{10.0**power:g}</text>')
    for power in range(spans[1][0], spans[1][1] + 1):
        y = place(1, power)
        parts.append(f'<path d="M{left},{y:.1f}H{end}" stroke="#ddd"/>')
        parts.append(f'<text x="{left - 8}" y="{y + 4:.1f}" text-anchor="end">{10.0**power:g}</text>')
    parts.append(
        f'<text x="{(left + end) / 2}" y="{bottom + 44}" text-anchor="middle">{escape(chart.x)}</text>'
        f'<text x="20" y="{(top + bottom) / 2}" transform="rotate(-90 20 {(top + bottom) / 2})" '
        f'text-anchor="middle">{escape(chart.y)}</text>'
    )
    for k, series in enumerate(dict.fromkeys(row[chart.series] for row in rows)):
        colour, y = _COLOURS[k % len(_COLOURS)], above + 12 + 20 * k
        parts.append(f'<circle cx="{end + 20}" cy="{y}" r="5" fill="{colour}"/>')
        parts.append(f'<text x="{end + 32}" y="{y + 4}">{escape(str(series))}</text>')
        for row in rows:
            if row[chart.series] == series:
                x, y_of = (place(n, math.log10(float(row[name]))) for n, name in ((0, chart.x), (1, chart.y)))
                told = f"{row[chart.label]}: {float(row[chart.x]):.3g}, {float(row[chart.y]):.3g}"
                parts.append(
                    f'<circle cx="{x:.1f}" cy="{y_of:.1f}" r="5" fill="{colour}" fill-opacity="0.8">'
                    f"<title>{escape(told)}</title></circle>"
                )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_SIZE[0]} {_SIZE[1]}" '
        f'font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="#fff"/>'
        f"{''.join(parts)}</svg>\n"
    )


def _is_positive(cell: Cell) -> bool:
    return not isinstance(cell, str) and cell > 0


def _written(cell: Cell) -> str:
    if isinstance(cell, str):
        return cell
    if isinstance(cell, int):
        return f"{cell:,}".replace(",", " ")
    return f"{cell:.3g}" if abs(cell) < 1000 else f"{cell:,.0f}".replace(",", " ")


def _processor() -> str:
    """The processor's name if the system tells it, else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
