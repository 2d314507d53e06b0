"""The result of a benchmark: a table that is printed, stored as JSON and drawn as a chart."""

from __future__ import annotations

import json
import os
import platform
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

Cell = float | int | str


@dataclass(frozen=True)
class Chart:
    """The columns of a chart with logarithmic scales: `x`, `y`, `series` (one colour for each value) and
    `label` (the text at a point)."""

    x: str
    y: str
    series: str
    label: str


@dataclass(frozen=True)
class Result:
    """One table: `rows` map column names to numbers or words; `notes` are sentences below it."""

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
        table.add_column(escape(column), justify="left" if words else "right", no_wrap=not words)
    for row in result.rows:
        table.add_row(*(_written(row[column]) if column in row else "" for column in columns))
    console.print(table)
    for note in result.notes:
        console.print(f"  {note}", highlight=False)
    console.print()


def store(name: str, result: Result, directory: Path) -> None:
    """Writes the table and a description of this computer to NAME.json."""
    directory.mkdir(parents=True, exist_ok=True)
    packages = {name: metadata.version(name) for name in ("feedplan", "numpy")}
    content = {
        "name": name,
        "title": result.title,
        "rows": result.rows,
        "notes": result.notes,
        "computer": {"processor": _processor(), "cores": os.cpu_count(), "system": platform.platform()},
        "versions": {"python": platform.python_version(), **packages},
    }
    path = directory / f"{name}.json"
    partial = path.with_suffix(".partial")
    partial.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    partial.replace(path)


# Colours that differ without red and green too.
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#332288", "#882255", "#666666")


def draw(name: str, result: Result, directory: Path) -> None:
    """Draws the chart, if the result has one, to NAME.svg, each point with its label."""
    chart = result.chart
    if chart is None:
        return
    from matplotlib.figure import Figure  # slow to import

    figure = Figure(figsize=(9.6, 6.0), layout="constrained")
    axes = figure.add_subplot(
        title=result.title, xlabel=chart.x, ylabel=chart.y, xscale="log", yscale="log", axisbelow=True
    )
    axes.grid(color="#ddd")
    axes.set_prop_cycle(color=_COLOURS)
    rows = [row for row in result.rows if _is_positive(row[chart.x]) and _is_positive(row[chart.y])]
    for series in dict.fromkeys(row[chart.series] for row in rows):
        own = [row for row in rows if row[chart.series] == series]
        axes.plot([row[chart.x] for row in own], [row[chart.y] for row in own], "o", label=series)
        for row in own:
            place = (row[chart.x], row[chart.y])
            axes.annotate(row[chart.label], place, (5, 3), textcoords="offset points", fontsize="x-small")
    figure.legend(loc="outside right upper")
    figure.savefig(directory / f"{name}.svg")


def _is_positive(cell: Cell) -> bool:
    return not isinstance(cell, str) and cell > 0


def _written(cell: Cell) -> str:
    if isinstance(cell, str):
        return cell
    if isinstance(cell, int):
        return f"{cell:,}".replace(",", " ")
    return f"{cell:.3g}" if abs(cell) < 1000 else f"{cell:,.0f}".replace(",", " ")


def _processor() -> str:
    """The name of the processor if the system gives it, else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
