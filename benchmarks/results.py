"""What a benchmark returns, how it is shown and how it is stored."""

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
    """Columns of a table to draw against each other on logarithmic scales: `x`, `y`, one colour for each
    value of `series`, and the `label` of a point."""

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
    """Print the table."""
    table = Table(
        title=result.title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD, pad_edge=False
    )
    columns = list(dict.fromkeys(column for row in result.rows for column in row))
    for column in columns:
        words = isinstance(result.rows[0].get(column), str)
        # Sentences give way to numbers.
        table.add_column(escape(column), justify="left" if words else "right", no_wrap=not words)
    for row in result.rows:
        table.add_row(*(_written(row[column]) if column in row else "" for column in columns))
    console.print(table)
    for note in result.notes:
        console.print(f"  {note}", highlight=False)
    console.print()


def store(result: Result, directory: Path) -> Path:
    """Write the table and the computer it was made on as JSON; the path of the file."""
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
    """Write the chart as a page; its path, None where the table has none."""
    if result.chart is None:
        return None
    from plotly.graph_objects import Figure, Scatter

    chart, figure = result.chart, Figure()
    for series in dict.fromkeys(row[chart.series] for row in result.rows):
        rows = [row for row in result.rows if row[chart.series] == series and _is_positive(row[chart.y])]
        figure.add_trace(
            Scatter(
                x=[row[chart.x] for row in rows],
                y=[row[chart.y] for row in rows],
                text=[row[chart.label] for row in rows],
                name=str(series),
                mode="markers",
                marker={"size": 10},
                hovertemplate="%{text}: %{x:.3g}, %{y:.3g}",
            )
        )
    figure.update_layout(title=result.title, template="plotly_white", hovermode="closest")
    figure.update_xaxes(title=chart.x, type="log")
    figure.update_yaxes(title=chart.y, type="log")
    path = directory / f"{result.name}.html"
    figure.write_html(path, include_plotlyjs="directory")
    return path


def _is_positive(cell: Cell) -> bool:
    return not isinstance(cell, str) and cell > 0


def _written(cell: Cell) -> str:
    if isinstance(cell, str):
        return cell
    if isinstance(cell, int):
        return f"{cell:,}".replace(",", " ")
    return f"{cell:.3g}" if abs(cell) < 1000 else f"{cell:,.0f}".replace(",", " ")


def _processor() -> str:
    """The processor's name where the system tells it, else its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
