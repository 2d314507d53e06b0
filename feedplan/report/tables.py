"""Makes the numbers and tables of the page as HTML; they need no script."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from feedplan.audit import Audit, LimitCheck
from feedplan.report.account import Account, Total
from feedplan.report.losses import Share, SlowLine
from feedplan.report.stops import Stops
from feedplan.units import (
    counted,
    distance_text,
    duration_text,
    mm_per_min,
    ratio_text,
    tolerance_text,
    way_unit,
)

# Names of checks on the page, if they differ from their names in the audit.
_NAMES = {
    "chord": "chord error",
    "deviation": "deviation from the program",
    "jump": "velocity jump at corners",
    "acceleration_jump": "acceleration step where the curvature jumps",
    "continuity": "speed jump between pieces",
    "acceleration_continuity": "acceleration jump along the path",
    "junction": "speed at corners and stops",
    "duration": "recorded durations",
    "order": "order of the phases",
    "gap": "gaps in the path",
    "place": "setpoints off the path",
    "grid": "time grid",
    "recorded_velocity": "recorded velocity",
    "recorded_acceleration": "recorded acceleration",
    "recorded_change": "recorded acceleration and velocity",
    "recorded_jerk": "recorded jerk and acceleration",
    "numbers": "numbers that are not finite",
}


def verdict(audit: Audit) -> str:
    """The audit's verdict in one line, with the broken limits."""
    samples = f"{audit.checked_samples:,}".replace(",", " ")
    if audit.ok:
        nearest = audit.nearest
        tight = f" Nearest to its limit: {_name(nearest)}, {100 * nearest.ratio:.2f} %." if nearest else ""
        text = f"<p>Every limit holds at {samples} checked samples.{tight}</p>"
        return f'<div class="verdict passed"><span class="mark">Audit passed</span>{text}</div>'
    broken = "".join(f"<li>{escape(sentence)}</li>" for sentence in audit.failures)
    count = len(audit.failures)
    limits = "limit is" if count == 1 else "limits are"
    head = f"{count} {limits} broken at {samples} checked samples. Do not run this plan."
    return (
        f'<div class="verdict failed"><span class="mark">Audit FAILED</span>'
        f"<div><p>{head}</p><ul>{broken}</ul></div></div>"
    )


def numbers(summary: Mapping[str, Any], account: Account, audit: Audit) -> str:
    """The key figures under the title."""
    time, whole = summary["time"], account.all
    unit, turning = account.motion.units
    turned = f"turns alone {whole.turn:.4g} {turning}" if whole.turn > 0 else ""
    length, mean = _length(whole.length, unit), (f"{whole.mean:.4g}", f"{unit}/s")
    by_minute = f"{mm_per_min(whole.mean):.5g} {unit}/min"
    if account.motion.turns.all():
        length, mean = (f"{whole.turn:.4g}", turning), (f"{whole.mean_turn:.4g}", f"{turning}/s")
        turned, by_minute = "", ""
    gap, bound = summary["gap"], f"{summary['lower_bound']:.6g} s"
    if audit.ok:
        proof = f"no plan of this path is faster{f' than {bound}' if gap > 1e-9 else ''}"
        distance = (_short(100.0 * gap), "%", proof)
    else:
        # A plan that breaks limits may be faster than the bound.
        distance = ("–", "", f"no plan of this path that keeps the limits is faster than {bound}")
    cells = [
        ("Time", *_value_unit(duration_text(time)), f"{time:.6g} s" if time >= 60 else ""),
        ("Gap to the bound", *distance),
        ("Length", *length, turned or counted(summary["pieces"], "piece")),
        ("Mean speed", *mean, by_minute),
        ("Stops on the length", str(summary["stops"]), "", counted(summary["runs"], "run")),
        ("Setpoints", f"{summary['setpoints']['count']:,}".replace(",", " "), "", ""),
    ]
    items = "".join(_number(*cell) for cell in cells)
    return f'<dl class="numbers card">{items}</dl>'


def _number(label: str, value: str, unit: str, more: str) -> str:
    size = "long" if len(value) > 9 else "short"
    shown = f'<dd class="{size}">{value}<small>{unit}</small></dd>'
    return f'<div><dt>{label}</dt>{shown}<p class="more">{more}</p></div>'


def limits_table(shares: Sequence[Share]) -> str:
    """Time per limit with bars."""
    head = '<th>Limit</th><th></th><th class="n">Part</th><th class="n">Time</th>'
    longest = max((share.part for share in shares), default=0.0) or 1.0
    rows = "".join(
        f"<tr><td>{escape(share.limit)}</td>"
        f'<td class="bar"><i style="width:{100 * share.part / longest:.1f}%"></i></td>'
        f'<td class="n">{100 * share.part:.1f} %</td><td class="n">{duration_text(share.time)}</td></tr>'
        for share in shares
    )
    return f"<table><tr>{head}</tr>{rows}</table>"


def totals_table(account: Account) -> str:
    """Time and length at a feed and in rapids; turning of rotary axes alone has its own row."""
    head = '<th>Motion</th><th class="n">Time</th><th class="n">Length</th><th class="n">Mean speed</th>'
    kinds = (("at a feed", account.feed), ("rapid", account.rapid))
    rows = "".join(_total_rows(name, total, account.motion.units) for name, total in kinds if total.time > 0)
    return f"<table><tr>{head}</tr>{rows}</table>"


def _total_rows(name: str, total: Total, units: tuple[str, str]) -> str:
    unit, turning = units
    parts = [
        (name, total.time - total.turn_time, f"{total.length:.6g} {unit}", f"{total.mean:.4g} {unit}/s"),
        (
            f"{name}, turning alone",
            total.turn_time,
            f"{total.turn:.6g} {turning}",
            f"{total.mean_turn:.4g} {turning}/s",
        ),
    ]
    return "".join(
        f'<tr><td>{label}</td><td class="n">{duration_text(time)}</td><td class="n">{length}</td>'
        f'<td class="n">{mean}</td></tr>'
        for label, time, length, mean in parts
        if time > 0
    )


def stops_table(stops: Sequence[Stops]) -> str:
    """Stops by cause: number, time for which the tool waits, time lost by braking and starting."""
    head = '<th>Stops</th><th class="n">Number</th><th class="n">Waits</th><th class="n">Lost</th>'
    rows = "".join(
        f'<tr><td>{escape(stop.cause)}</td><td class="n">{stop.count}</td>'
        f'<td class="n">{duration_text(stop.pause) if stop.pause > 0 else "–"}</td>'
        f'<td class="n">{duration_text(stop.lost)}</td></tr>'
        for stop in stops
    )
    return f"<table><tr>{head}</tr>{rows}</table>"


def fit_table(summary: Mapping[str, Any], tolerance: tuple[float, float]) -> str:
    """Figures of the fit, computing time of each stage, and least and greatest requested `tolerance` [mm]."""
    fit, gain = summary["fit"], summary["gain"]
    rows: list[tuple[str, str]] = []
    points, splines, polynomials = (fit[key] for key in ("points", "splines", "polynomials"))
    if points and splines:
        rows += [
            ("Points fitted", f"{points}"),
            ("B-splines", f"{splines} <span class='tag'>{ratio_text(points, splines)}</span>"),
        ]
        if polynomials:
            rows.append(
                ("Polynomials", f"{polynomials} <span class='tag'>{ratio_text(points, polynomials)}</span>")
            )
    else:
        rows.append(("Fit", "nothing to fit"))
    unit = way_unit(summary)
    rows.append(("Tolerance asked for", tolerance_text(*tolerance, unit)))
    rows.append(("Deviation from the program", _distance(fit["deviation"], unit)))
    if fit["mean_offset"] is not None:
        rows += [
            (name, _distance(fit[key], unit))
            for name, key in (
                ("… inside, at most", "inside"),
                ("… outside, at most", "outside"),
                ("… of bends in the mean, outside positive", "mean_offset"),
            )
        ]
    if gain:
        rows.append(("Time along the path as fitted", duration_text(gain["times"][0])))
        rows.append(("… gained by fits to the speed", f"{_short(gain['gained'])} s"))
    rows.append(("Pieces planned", f"{summary['pieces']} in {counted(summary['runs'], 'run')}"))
    rows += [(f"Time to {name}", duration_text(seconds)) for name, seconds in summary["compute"].items()]
    body = "".join(f'<tr><td>{escape(name)}</td><td class="n">{value}</td></tr>' for name, value in rows)
    return f"<table>{body}</table>"


def slowest_table(rows: Sequence[SlowLine], texts: Mapping[int, str], units: tuple[str, str]) -> str:
    """The lines that lose most time, with their text if it is known."""
    if not rows:
        return "<table><tr><td>No line is slower than its feed and its axes allow.</td></tr></table>"
    head = '<th class="n">Line</th>' + ("<th>Source</th>" if texts else "")
    body = "".join(_slow_row(row, texts, units) for row in rows)
    return (
        f'<table><tr>{head}<th class="n">Lost</th><th class="n">Time</th><th class="n">Mean speed</th>'
        f'<th class="n">Wanted</th><th>Because of</th></tr>{body}</table>'
    )


def _slow_row(row: SlowLine, texts: Mapping[int, str], units: tuple[str, str]) -> str:
    text = escape(texts.get(row.line, "").strip()[:120])
    unit = f"{units[row.turns]}/s"
    cells = [
        f'<td class="n">{row.line or "–"}</td>',
        f'<td class="code"><code>{text}</code></td>' if texts else "",
        f'<td class="n">{duration_text(row.lost)}</td><td class="n">{duration_text(row.time)}</td>',
        f'<td class="n">{row.speed:.4g} {unit}</td><td class="n">{row.wanted:.4g} {unit}</td>',
        f"<td>{escape(row.limit)} <span class='tag'>{100 * row.part:.0f} %</span>",
        "<span class='tag'>stop</span>" if row.stops else "",
        "<span class='tag'>rapid</span></td>" if row.rapid else "</td>",
    ]
    return f"<tr>{''.join(cells)}</tr>"


def audit_table(audit: Audit) -> str:
    """Every check: the worst value, the limit, their ratio, time and line.

    Limits come first; the checks of consistency are folded unless one of them fails.
    """
    known = [check for check in audit.checks if not check.ok or math.isfinite(check.limit)]
    limits = [check for check in known if check.is_limit]
    others = [check for check in known if not check.is_limit]
    table = _audit_rows(limits)
    if not others:
        return table
    failed = sum(not check.ok for check in others)
    word = f"{failed} of {len(others)} fail" if failed else f"all {len(others)} hold"
    state = " open" if failed else ""
    title = f"<summary>Consistency of path, profile and setpoints: {word}</summary>"
    return f"{table}<details{state}>{title}{_audit_rows(others)}</details>"


def _audit_rows(checks: Sequence[LimitCheck]) -> str:
    columns = (
        ("", "Limit"),
        ("n", "Worst"),
        ("n", "Allowed"),
        ("", "Use"),
        ("n", ""),
        ("n", "At time [s]"),
        ("n", "Line"),
        ("", ""),
    )
    head = "".join(f'<th class="{kind}">{text}</th>' for kind, text in columns)
    return f"<table><tr>{head}</tr>{''.join(_audit_row(check) for check in checks)}</table>"


def _audit_row(check: LimitCheck) -> str:
    kind, word = ("", "holds") if check.ok else ("broken", "broken")
    if not check.judged:
        kind, word = "unjudged", "not judged"
    width = 100 * min(max(check.ratio, 0.0), 1.0) if math.isfinite(check.ratio) else 100.0
    bar = f'<span class="ratio {kind}"><i style="width:{width:.1f}%"></i></span>'
    return (
        f'<tr class="{kind}-row"><td>{_name(check)}</td><td class="n">{_with_unit(check, check.worst)}</td>'
        f'<td class="n">{_with_unit(check, check.limit)}</td><td class="bar">{bar}</td>'
        f'<td class="n">{_percent(check.ratio)}</td>'
        f'<td class="n">{f"{check.time:.4f}" if math.isfinite(check.time) else "–"}</td>'
        f'<td class="n">{check.line or "–"}</td><td class="verdict-cell">{word}</td></tr>'
    )


def _name(check: LimitCheck) -> str:
    return escape(f"{check.axis or ''} {_NAMES.get(check.name, check.name)}".strip())


def _with_unit(check: LimitCheck, value: float) -> str:
    if not math.isfinite(value):
        return "no limit" if value > 0 else "–"
    return f"{value:.6g} {check.unit}".strip()


def _percent(ratio: float) -> str:
    """A ratio as percent; near 100 with enough digits to show on which side of 100 it is."""
    if not math.isfinite(ratio):
        return "–"
    percent = 100.0 * ratio
    if percent != 100.0 and abs(percent - 100.0) < 0.01:
        return f"100 % {'+' if percent > 100 else '-'} {abs(percent - 100.0):.1g}"
    return f"{percent:.2f} %"


def _short(value: float) -> str:
    return "0" if abs(value) < 1e-9 else f"{value:.3g}"


def _distance(value: float, unit: str) -> str:
    return distance_text(0.0 if abs(value) < 1e-12 else value, unit)


def _length(length: float, unit: str) -> tuple[str, str]:
    if unit != "mm":
        return f"{length:.6g}", unit
    return (f"{length:.1f}", "mm") if length < 10_000 else (f"{length / 1000:,.1f}".replace(",", " "), "m")


def _value_unit(text: str) -> tuple[str, str]:
    """Splits `1.234 s` into value and unit; texts with more parts are not split."""
    value, _, unit = text.partition(" ")
    return (value, unit) if " " not in unit else (text, "")
