"""Makes the section "gained" of the page: the controller's time today, the plan's time, and the time saved by
raised limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from feedplan.units import counted, difference_text, duration_text

Rows = Sequence[tuple[str, str, float | None]]


def gained(summary: Mapping[str, Any]) -> str:
    """The section as HTML; empty if plan.json (`summary`) has none of these times."""
    time = summary["time"]
    columns = []
    if today := summary["today"]:
        columns.append(_column("Today and by the plan", _today_note(summary), _today_rows(today, time)))
    if steps := summary.get("one_step_more"):
        note = "The plan again with this limit alone raised."
        columns.append(_column("What one step more would bring", note, _step_rows(steps, time)))
    if planned := summary.get("planned_program"):
        text = f"{counted(planned['changed'], 'line')} of {planned['lines']} with another F"
        split = f"{planned['split']} split, {planned['left']} left as they were"
        rows = [(text, planned["file"], None), (split, "", None)]
        columns.append(_column("The program with planned feeds", "What a controller takes.", rows))
    return f'<section class="two">\n{"".join(columns)}</section>\n' if columns else ""


def _today_note(summary: Mapping[str, Any]) -> str:
    if summary["today"]["time"] < summary["lower_bound"]:
        return "A model of the controller. No plan of this path within the limits is as fast as it."
    return "The time that a model of the controller tells for the program as it is."


def _today_rows(today: Mapping[str, Any], time: float) -> Rows:
    before, saved = today["time"], today["saved"]
    verb = "Saved" if saved >= 0.0 else "Longer by"
    return [
        (f"Today, by {today['controller']}", duration_text(before), before),
        ("By the plan", duration_text(time), time),
        (verb, difference_text(saved, before), abs(saved)),
    ]


def _step_rows(steps: Sequence[Mapping[str, Any]], time: float) -> Rows:
    rows = []
    for step in steps:
        saved = step["saved"]
        text = difference_text(saved, time, "less" if saved >= 0.0 else "more")
        rows.append((f"{step['limit']} × {step['factor']:g}", text, abs(saved)))
    return rows


def _column(title: str, note: str, rows: Rows) -> str:
    """A table with a bar for each number, whose length is the number over the greatest one."""
    most = max((size for _, _, size in rows if size is not None), default=0.0) or 1.0
    body = "".join(
        f'<tr><td>{escape(name)}</td>{_bar(size, most)}<td class="n">{escape(text)}</td></tr>'
        for name, text, size in rows
    )
    head = f'<div class="head"><div><h2>{escape(title)}</h2>\n<p class="note">{escape(note)}</p></div></div>'
    return f'<div>{head}\n<div class="card wide"><table>{body}</table></div></div>\n'


def _bar(size: float | None, most: float) -> str:
    if size is None:
        return "<td></td>"
    return f'<td class="bar"><i style="width:{100.0 * size / most:.1f}%"></i></td>'
