"""Writes the rows of a batch as batch.csv, batch.json and a table for the terminal."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path as FilePath
from typing import Any

from feedplan.batch.sweep import SUMMARY, TABLE
from feedplan.outputs._staging import staged
from feedplan.plan_folder import summary_text
from feedplan.units import duration_text

COLUMNS = (
    *("folder", "program", "machine", "tolerance", "method", "time", "lower_bound", "gap"),
    *("computing", "ok", "error"),
)
HEADER = ("plan", "machine", "tolerance", "method", "time s", "gap", "computing", "audit")


def summary_of(rows: Sequence[dict[str, Any]], kept: int, seconds: float) -> dict[str, Any]:
    """The content of batch.json: the number of plans, how many of them existed already (`kept`), all rows."""
    return {
        "format": 1,
        "plans": len(rows),
        "planned_before": kept,
        "failed": sum(row["error"] is not None for row in rows),
        "limits_broken": sum(row["ok"] is False for row in rows),
        "seconds": seconds,
        "rows": [{name: value for name, value in row.items() if name != "fingerprint"} for row in rows],
    }


def write_summary(summary: dict[str, Any], folder: FilePath) -> tuple[FilePath, ...]:
    """Writes both files; returns their paths. Raises InputError if they cannot be written."""
    with staged(folder, last=SUMMARY) as stage:
        (stage / SUMMARY).write_text(summary_text(summary), encoding="utf-8")
        with (stage / TABLE).open("w", encoding="utf-8", errors="replace", newline="") as stream:
            table = csv.DictWriter(stream, COLUMNS, extrasaction="ignore", lineterminator="\n")
            table.writeheader()
            table.writerows({name: _cell(value) for name, value in row.items()} for row in summary["rows"])
    return folder / TABLE, folder / SUMMARY


def _cell(value: Any) -> Any:
    # A spreadsheet would read texts that begin with these characters as formulas.
    return f"'{value}" if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t") else value


def table_rows(rows: Sequence[dict[str, Any]]) -> list[tuple[str, ...]]:
    """The rows of the terminal's table, with the columns of `HEADER`."""
    return [
        (
            row["folder"],
            row["machine"],
            "own" if row["tolerance"] is None else f"{row['tolerance']:g}",
            row["method"],
            "-" if row["time"] is None else f"{row['time']:.3f}",
            "-" if row["gap"] is None else f"{100 * row['gap']:.3g} %",
            duration_text(row["computing"]),
            "-" if row["ok"] is None else "passed" if row["ok"] else "FAILED",
        )
        for row in rows
    ]
