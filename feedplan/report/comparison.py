"""Makes the page of a comparison: a row for each method, the speeds in one chart, linked to the tool path."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path as FilePath
from string import Template
from typing import TYPE_CHECKING, Any

from feedplan.report.page import asset, framed, pictures
from feedplan.units import duration_text

if TYPE_CHECKING:
    from feedplan.audit import LimitCheck

FILE = "comparison.html"


def write_comparison(
    file: FilePath,
    *,
    title: str,
    about: Mapping[str, str],
    rows: Sequence[Mapping[str, Any]],
    limits: Sequence[str],
    paths: Sequence[Mapping[str, Any]],
) -> None:
    """Writes the page.

    Each of `rows` has `method`, `time`, `gap`, `computing` [s], `audit` (ok or not), `worst` (the worst
    check of each of `limits`), or `time` None and an `error`. `paths` are `ToolPath.data()` of the rows that
    have a plan, with their `method`.
    """
    told = " · ".join(f"{escape(name)} <b>{escape(value)}</b>" for name, value in about.items())
    table = Template(asset("comparison.html")).substitute(table=_table(rows, limits))
    sections = table + pictures(asset("comparison_charts.html"))
    data = {"methods": list(paths)}
    file.write_text(framed("comparison", title, told, "", sections, data), encoding="utf-8")


def _table(rows: Sequence[Mapping[str, Any]], limits: Sequence[str]) -> str:
    shown = [name for name in limits if any((row.get("worst") or {}).get(name) for row in rows)]
    heads = [
        '<th>Method</th><th class="n">Time</th><th></th><th class="n">Gap of its path</th>',
        '<th class="n">Computing</th>',
        *(f'<th class="n">{escape(name.capitalize())}</th>' for name in shown),
        "<th>Audit</th>",
    ]
    times = [row["time"] for row in rows if row.get("time") is not None]
    body = "".join(_row(row, shown, max(times, default=0.0)) for row in rows)
    return f'<table class="many"><tr>{"".join(heads)}</tr>{body}</table>'


def _row(row: Mapping[str, Any], limits: Sequence[str], longest: float) -> str:
    name = f"<td><b>{escape(row['method'])}</b></td>"
    if row.get("time") is None:
        error = escape(str(row.get("error")))
        return (
            f'<tr class="unjudged-row">{name}<td class="reason" colspan="{5 + len(limits)}">{error}</td></tr>'
        )
    part = 100 * row["time"] / longest if longest > 0 else 0.0
    cells = [
        name,
        f'<td class="n">{duration_text(row["time"])}</td>',
        f'<td class="bar"><i style="width:{part:.1f}%"></i></td>',
        f'<td class="n">{"–" if row["gap"] is None else _percent(row["gap"])}</td>',
        f'<td class="n">{duration_text(row["computing"])}</td>',
        *(_use(row["worst"].get(limit)) for limit in limits),
        f'<td class="verdict-cell">{"passed" if row["audit"] else "FAILED"}</td>',
    ]
    return f'<tr class="{"" if row["audit"] else "broken"}-row">{"".join(cells)}</tr>'


def _use(check: LimitCheck | None) -> str:
    if check is None or not math.isfinite(check.ratio):
        return '<td class="n">–</td>'
    if not check.judged:
        return f'<td class="n soft">{_percent(check.ratio)}</td>'
    where = f"{check.axis or ''} line {check.line}" if check.line else check.axis or ""
    title = f"{where}, {check.time:.4f} s" if math.isfinite(check.time) else where
    kind = "n" if check.ok else "n broken"
    mark = "" if check.ok else f" <span class='tag'>{escape(where.strip())}</span>"
    return f'<td class="{kind}" title="{escape(title.strip())}">{_percent(check.ratio)}{mark}</td>'


def _percent(ratio: float) -> str:
    return f"{100.0 * ratio:.3g} %" if ratio < 9.995 else f"{100.0 * ratio:.0f} %"
