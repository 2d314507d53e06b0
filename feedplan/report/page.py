"""The report: one self-contained page that needs no network."""

from __future__ import annotations

import importlib.util
import io
import json
from collections.abc import Mapping, Sequence
from html import escape
from importlib import resources
from pathlib import Path as FilePath
from string import Template
from typing import Any

from feedplan.audit import Audit
from feedplan.constraints.problem import Problem
from feedplan.profile import SpeedProfile
from feedplan.progress import Listener, part, tell
from feedplan.report.account import Account
from feedplan.report.activity import ACTIVE
from feedplan.report.figures import SetpointFigures, chart_data
from feedplan.report.tables import (
    audit_table,
    fit_table,
    limits_table,
    numbers,
    slowest_table,
    stops_table,
    totals_table,
    verdict,
)

FILE = "report.html"

# What the chart of speed over length shows, by whether the method limits jerk.
_SPEED = {
    False: "The planned speed touches one limit everywhere: it follows the feed, an axis velocity or the "
    "limit curve of the axis accelerations, or it is on its way between them with one axis at full "
    "acceleration.",
    True: "The planned speed below the feed, the axis velocities and the limit curve of the axis "
    "accelerations; these know no jerk, which holds it further down.",
}


def write_report(
    file: FilePath,
    *,
    summary: Mapping[str, Any],
    problem: Problem,
    profile: SpeedProfile,
    account: Account,
    audit: Audit,
    figures: SetpointFigures,
    text: FilePath | bytes | None = None,
    progress: Listener | None = None,
) -> None:
    """Writes the page. `summary` is the content of plan.json, `text` the part program's, or its file.

    `progress` is told how far it is."""
    texts = {} if text is None else _lines(text, {row.line for row in account.slow})
    tell(progress, 0.0)
    data = chart_data(problem, profile, account.motion, figures, audit, part(progress, 0.0, 0.9))
    tell(progress, 0.9)
    name = FilePath(str(summary.get("program") or "path")).name
    judged = (
        verdict(audit),
        numbers(summary, account, figures.count),
        _warnings(summary.get("warnings") or ()),
    )
    charts = Template(asset("page_charts.html")).substitute(
        speed=_SPEED[any(check.name == "jerk" and check.judged for check in audit.checks)],
        fast=f"{data['length']['cutting_speed']:.4g} {account.motion.unit}/s",
    )
    tables = Template(asset("page.html")).substitute(
        limits=limits_table(account.limits),
        active=f"{100 * ACTIVE:g} %",
        totals=totals_table(account),
        stops=stops_table(account.stops),
        fit=fit_table(summary, account.tolerance),
        slowest=slowest_table(account.slow, texts, account.motion.units),
        audit=audit_table(audit),
    )
    about, sections = _about(summary, problem), pictures(charts) + tables
    file.write_text(
        framed("report", name, about, "\n".join(judged), sections, data, "page.js"), encoding="utf-8"
    )


def framed(
    kind: str, title: str, about: str, summary: str, sections: str, data: Mapping[str, Any], script: str
) -> str:
    """A whole page of HTML around its sections, with the data that its script draws, if it can."""
    drawn = not missing_pictures()
    return Template(asset("frame.html")).substitute(
        kind=kind,
        title=escape(title),
        style=asset("page.css"),
        about=about,
        summary=summary,
        sections=sections,
        data=_script_data(data if drawn else {}),
        plotly=_plotly_script() if drawn else "",
        script="".join(asset(name) for name in ("charts.js", "path.js", script)) if drawn else "",
    )


def missing_pictures() -> str:
    """Why a page has no pictures, in a sentence; empty where it has them."""
    if importlib.util.find_spec("plotly") is not None:
        return ""
    return "the page has no pictures, which need the package plotly: `pip install plotly`"


def pictures(charts: str) -> str:
    """The sections with charts, or why there are none."""
    missing = missing_pictures()
    return f'<section><p class="note">{escape(missing)}</p></section>\n' if missing else charts


def _lines(text: FilePath | bytes, wanted: set[int]) -> dict[int, str]:
    """The text of these lines; none where the file is gone or is no text."""
    texts: dict[int, str] = {}
    try:
        with io.BytesIO(text) if isinstance(text, bytes) else text.open("rb") as stream:
            for number, line in enumerate(stream, start=1):
                if number in wanted:
                    texts[number] = line.decode("utf-8", errors="replace")
                    if len(texts) == len(wanted):
                        break
    except OSError:
        return {}
    return texts


def asset(name: str) -> str:
    """A file of this package as text."""
    return resources.files(__package__).joinpath(name).read_text("utf-8")


def _script_data(data: Mapping[str, Any]) -> str:
    """Data as JSON within a script, which ends at the first "</", whatever stands around it."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")


def _plotly_script() -> str:
    """The library that draws the charts."""
    from plotly.offline import get_plotlyjs

    return str(get_plotlyjs()).replace("</script", "<\\/script")


def _about(summary: Mapping[str, Any], problem: Problem) -> str:
    parts = [
        f"machine <b>{escape(str(summary.get('machine')))}</b>",
        f"method <b>{escape(str(summary.get('method')))}</b>",
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
