"""Makes the report: one self-contained page that needs no network."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from html import escape
from importlib import resources
from itertools import islice
from pathlib import Path as FilePath
from string import Template
from typing import Any

from feedplan.audit import Audit
from feedplan.constraints.problem import Problem
from feedplan.report import tables
from feedplan.report.account import Account
from feedplan.report.activity import ACTIVE
from feedplan.report.container import as_text, contained
from feedplan.report.gained import gained

FILE = "report.html"
# The script and the style of all pages; `make page` builds them from the folder page/.
SCRIPT, STYLE = "bundle/page.js", "bundle/page.css"

# Description of the chart of speed over length, for methods without and with limits of jerk.
_SPEED = {
    False: "The planned speed is at one limit everywhere: it follows the feed, an axis velocity or the "
    "limit curve of the axis accelerations, or it changes from one to another with one axis at full "
    "acceleration.",
    True: "The planned speed below the feed, the axis velocities and the limit curve of the axis "
    "accelerations. These take no account of the limits of jerk, which lower the speed further.",
}


def write_report(
    file: FilePath,
    *,
    summary: Mapping[str, Any],
    problem: Problem,
    account: Account,
    audit: Audit,
    data: Mapping[str, Any],
    text: FilePath | bytes | None = None,
) -> None:
    """Writes the page. `summary` is the content of plan.json, `data` the result of `chart_data`, `text` the
    text of the part program, or its file; None if its lines have no numbers."""
    texts = {} if text is None else _lines(text, {row.line for row in account.slow})
    name = FilePath(summary["program"] or "path").name
    judged = (
        tables.verdict(audit),
        tables.numbers(summary, account, audit),
        _warnings(summary["warnings"]),
    )
    charts = Template(asset("page_charts.html")).substitute(
        speed=_SPEED[any(check.name == "jerk" and check.judged for check in audit.checks)],
        fast=f"{data['length']['cutting_speed']:.4g} {account.motion.unit}/s",
    )
    details = Template(asset("page.html")).substitute(
        limits=tables.limits_table(account.limits),
        active=f"{100 * ACTIVE:g} %",
        totals=tables.totals_table(account),
        stops=tables.stops_table(account.stops),
        fit=tables.fit_table(summary, account.tolerance),
        slowest=tables.slowest_table(account.slow, texts, account.motion.units),
        audit=tables.audit_table(audit),
    )
    about, sections = _about(summary, problem), gained(summary) + pictures(charts) + details
    file.write_text(framed("report", name, about, "\n".join(judged), sections, data), encoding="utf-8")


def framed(kind: str, title: str, about: str, summary: str, sections: str, data: Mapping[str, Any]) -> str:
    """A whole page of HTML with these sections and, if the script is built, the data that it draws."""
    drawn = not missing_pictures()
    return Template(asset("frame.html")).substitute(
        kind=kind,
        title=escape(title),
        style=asset("page.css") + (asset(STYLE) if drawn else ""),
        about=about,
        summary=summary,
        sections=sections,
        data=as_text(contained(data)) if drawn else "",
        script=asset(SCRIPT).replace("</script", "<\\/script") if drawn else "",
    )


def missing_pictures() -> str:
    """A sentence with the reason why pages have no pictures; empty if they have."""
    if resources.files(__package__).joinpath(SCRIPT).is_file():
        return ""
    return (
        "the page has no pictures, for this feedplan was installed without the code that draws them: "
        "run `make page` in its source, which needs Node.js, and install it again"
    )


def pictures(charts: str) -> str:
    """The sections with charts, or the reason why there are none."""
    missing = missing_pictures()
    return f'<section><p class="note">{escape(missing)}</p></section>\n' if missing else charts


def _lines(text: FilePath | bytes, wanted: set[int]) -> dict[int, str]:
    """The text of the wanted lines, with the same line ends as in the reader (LF, CR LF, CR); empty if the
    file is gone."""
    try:
        with (
            io.BytesIO(text) if isinstance(text, bytes) else text.open("rb") as content,
            io.TextIOWrapper(content, "utf-8", "replace") as stream,
        ):
            lines = enumerate(islice(stream, max(wanted, default=0)), 1)
            return {number: line for number, line in lines if number in wanted}
    except OSError:
        return {}


def asset(name: str) -> str:
    """A file of this package as text."""
    return resources.files(__package__).joinpath(name).read_text("utf-8")


def _about(summary: Mapping[str, Any], problem: Problem) -> str:
    parts = [
        f"machine <b>{escape(summary['machine'])}</b>",
        f"method <b>{escape(summary['method'])}</b>",
        f"servo period <b>{problem.period * 1e3:g} ms</b>",
        f"axes <b>{' '.join(problem.axes)}</b>",
    ]
    return " · ".join(parts)


def _warnings(warnings: Sequence[str]) -> str:
    if not warnings:
        return ""
    shown = "".join(f"<li>{escape(text)}</li>" for text in warnings[:12])
    more = f"<li>and {len(warnings) - 12} more, all in plan.json</li>" if len(warnings) > 12 else ""
    return f'<ul class="warnings">{shown}{more}</ul>'
