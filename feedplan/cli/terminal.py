"""Prints results: tables on a terminal, plain text in a pipe; progress on a terminal only."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from feedplan.errors import LONGEST
from feedplan.units import (
    counted,
    difference_text,
    distance_text,
    duration_text,
    mm_per_min,
    ratio_text,
    tolerance_text,
    way_unit,
)

if TYPE_CHECKING:
    from feedplan.audit import Audit, LimitCheck
    from feedplan.comparison import Row

Rows = Sequence[tuple[str, str]]


def print_rows(rows: Rows) -> None:
    """Prints names and values, one pair a line."""
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.table import Table
        from rich.text import Text

        table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
        table.add_column(style="dim", no_wrap=True)
        table.add_column(overflow="fold")
        for name, value in rows:
            table.add_row(name, Text(value, style=_style(name, value)))
        Console().print(table)
        return
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"{name:<{width}}  {value}")


def print_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Prints a table; the first column is text, the others are numbers."""
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.table import Table

        table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
        for column, name in enumerate(header):
            table.add_column(name, justify="right" if column else "left", no_wrap=True)
        for row in rows:
            table.add_row(*row)
        Console().print(table, markup=False)
        return
    widths = [max(len(row[k]) for row in (header, *rows)) for k in range(len(header))]
    for row in (header, *rows):
        cells = [f"{cell:>{widths[k]}}" if k else f"{cell:<{widths[0]}}" for k, cell in enumerate(row)]
        print("  ".join(cells).rstrip())


def print_json(summary: dict[str, Any]) -> None:
    """Prints a result as JSON, for `--json`."""
    from feedplan.plan_folder import summary_text

    sys.stdout.write(summary_text(summary))


def warn(sentences: Iterable[str]) -> None:
    """Prints warnings on standard error."""
    for sentence in sentences:
        print(f"warning: {sentence}", file=sys.stderr)


@contextmanager
def progress_bar(quiet: bool) -> Iterator[Callable[[str, float], None] | None]:
    """A function that shows the progress of a stage on a terminal; None elsewhere."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description:<7}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    tasks: dict[str, TaskID] = {}
    # A copy of standard error, because `silenced` redirects the process's own.
    with (
        os.fdopen(os.dup(sys.stderr.fileno()), "w", encoding="utf-8", errors="replace") as stream,
        Progress(*columns, TimeElapsedColumn(), console=Console(file=stream), transient=True) as bars,
    ):

        def show(stage: str, done: float) -> None:
            if stage not in tasks:
                # When a stage begins, the stages before it are finished, even if they did not report 1.0.
                for earlier in tasks.values():
                    bars.update(earlier, completed=1.0)
                tasks[stage] = bars.add_task(stage, total=1.0)
            bars.update(tasks[stage], completed=done)

        yield show


@contextmanager
def silenced() -> Iterator[None]:
    """Discards what other packages print, also from C code; the progress bar stays."""
    with ExitStack() as stack:
        nothing = stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
        for stream, number in ((sys.stdout, 1), (sys.stderr, 2)):
            stream.flush()
            with suppress(OSError):  # the parent process may have closed the stream
                kept = os.dup(number)
                stack.callback(os.close, kept)
                stack.callback(os.dup2, kept, number)
                os.dup2(nothing.fileno(), number)
        with redirect_stdout(nothing), redirect_stderr(nothing):
            yield


def _style(name: str, value: str) -> str:
    if name == "audit":
        return "bold green" if value.startswith("passed") else "bold red"
    return "bold" if name == "time" else ""


def plan_rows(summary: Mapping[str, Any], audit: Audit, files: Sequence[FilePath]) -> Rows:
    """The result of a plan as names and values."""
    time = summary["time"]
    rows = [(name, str(summary[name])) for name in ("program", "machine", "method")]
    seconds = f" ({time:.6f} s)" if time >= 60 else ""
    rows.append(("time", duration_text(time) + seconds))
    bound, own = f"{summary['lower_bound']:.6f} s for this path", summary["estimated_gap"]
    by_itself = "" if own is None else f", by its own estimate {100.0 * own:.2g} %"
    # A plan that breaks limits may be faster than the bound.
    distance = f"gap {100.0 * summary['gap']:.3g} %{by_itself}" if audit.ok else "which keeps the limits"
    rows.append(("lower bound", f"{bound}, {distance}"))
    if today := summary["today"]:
        rows.append(("today", today_text(today, summary["lower_bound"])))
    units, turn = summary["units"], f"{summary['turn']:.6g} {summary['units']['angle']}"
    if summary["turn"] > 0 and summary["length"] == 0:
        rows.append(("length", f"{turn}, mean {summary['mean_turn']:.4g} {units['angle']}/s"))
    else:
        mean, unit = summary["mean_speed"], units["length"]
        by_minute = f"({mm_per_min(mean):.5g} {unit}/min)"
        rows.append(("length", f"{summary['length']:.3f} {unit}, mean {mean:.4g} {unit}/s {by_minute}"))
        if summary["turn"] > 0:
            rows.append(("turning alone", turn))
    totals = summary["totals"]
    rows += [
        (name, _total_text(totals[name], units)) for name in ("feed", "rapid") if totals[name]["time"] > 0
    ]
    rows.append(("limits", _limits_text(summary["limits"])))
    rows += step_rows(summary.get("one_step_more") or ())
    rows.append(("stops", _stops_text(summary["stops_by_cause"])))
    rows.append(("tolerance", tolerance_text(**summary["tolerance"], unit=way_unit(summary))))
    rows.append(("path", f"{pieces_text(summary)}, {counted(summary['stops'], 'stop')} on the way"))
    rows += fit_rows(summary["fit"], way_unit(summary))
    if summary["gain"]:
        rows.append(("faster path", gain_text(summary["gain"])))
    rows.append(("audit", audit_text(audit)))
    rows.append(("computing", ", ".join(f"{k} {duration_text(v)}" for k, v in summary["compute"].items())))
    if files:
        rows.append(("files", " ".join(str(file) for file in files)))
    return rows


def today_text(today: Mapping[str, Any], lower_bound: float | None = None) -> str:
    """`2 min 52.8 s by grbl: the plan saves 12.0 s, 7.0 %`.

    A time below the lower bound of the path breaks limits; the text says so.
    """
    time, saved = today["time"], today["saved"]
    verb = "saves" if saved >= 0 else "takes longer by"
    gain = f"the plan {verb} {difference_text(saved, time)}"
    text = f"{duration_text(time)} by {today['controller']}: {gain}"
    beyond = lower_bound is not None and time < lower_bound
    return f"{text} (no plan of this path within the limits is as fast)" if beyond else text


def step_rows(steps: Sequence[Mapping[str, Any]]) -> Rows:
    """The time that one step more of each limit saves, one row each: `feed × 1.2`, `1.234 s less`."""
    return [
        (
            f"{step['limit']} × {step['factor']:g}",
            f"{duration_text(abs(step['saved']))} {'less' if step['saved'] >= 0 else 'more'}",
        )
        for step in steps
    ]


def _total_text(total: Mapping[str, float], units: Mapping[str, str]) -> str:
    """`1.2 s, 80 mm`, with degrees where rotary axes move alone; `1.2 s, 90 deg` if nothing else moves."""
    if total["length"] == 0 and total["turn"] > 0:
        return f"{duration_text(total['time'])}, {total['turn']:.4g} {units['angle']}"
    turn = f", {total['turn']:.4g} {units['angle']} alone" if total["turn"] > 0 else ""
    return f"{duration_text(total['time'])}, {total['length']:.6g} {units['length']}{turn}"


def _limits_text(limits: Mapping[str, Mapping[str, float]]) -> str:
    """The share of the time in which each limit is active; shares below 0.1 % are left out."""
    parts = [f"{name} {100 * share['part']:.1f} %" for name, share in limits.items() if share["part"] >= 1e-3]
    return ", ".join(parts)


def _stops_text(stops: Sequence[Mapping[str, Any]]) -> str:
    """`2 × start and end, 3 × exact stop (G61.1)`."""
    return ", ".join(f"{row['count']} × {row['cause']}" for row in stops)


def pieces_text(summary: Mapping[str, Any]) -> str:
    """`605 pieces in 29 runs`."""
    return f"{counted(summary['pieces'], 'piece')} in {counted(summary['runs'], 'run')}"


def fit_rows(fit: Mapping[str, Any], unit: str = "mm") -> list[tuple[str, str]]:
    """Points, splines and deviation of a fit, with the unit of its distances; empty if nothing was fitted."""
    points, splines, polynomials = (fit[key] for key in ("points", "splines", "polynomials"))
    if not points or not splines:
        return []
    text = f"{counted(points, 'point')} as {counted(splines, 'spline')} ({ratio_text(points, splines)})"
    if polynomials:
        text += f" of {counted(polynomials, 'polynomial')} ({ratio_text(points, polynomials)})"
    return [("fit", text), ("deviation", f"{fit['deviation']:.3g} {unit}"), *_side_rows(fit, unit)]


def gain_text(gain: Mapping[str, Any]) -> str:
    """The time saved by a path that is fitted to the speed, as text."""
    times = " → ".join(duration_text(float(seconds)) for seconds in gain["times"])
    if len(gain["times"]) == 1:
        return f"{times} as fitted: a path fitted to the speed gains nothing"
    text = f"{times}; the last fit is faster in {gain['faster']} of {counted(gain['sections'], 'section')}"
    promised = [duration_text(float(seconds)) for seconds in gain["promised"]]
    if promised:
        *taken, following = promised
        steps = f"the steps promised {', '.join(taken)}, one more" if taken else "a step along the gradient"
        text += f"; {steps} promises {following}"
    return text


def _side_rows(fit: Mapping[str, Any], unit: str) -> list[tuple[str, str]]:
    """Offsets of a smooth path from the program by side; empty for other paths."""
    if fit["mean_offset"] is None:
        return []
    inside, outside = (distance_text(fit[key], unit) for key in ("inside", "outside"))
    mean = distance_text(fit["mean_offset"], unit, "+.2g")
    return [("sides", f"{inside} inside at most, {outside} outside, bends {mean} in the mean")]


def audit_text(audit: Audit) -> str:
    """The verdict in one line."""
    samples = f"{audit.checked_samples} samples"
    if not audit.ok:
        return f"FAILED, {len(audit.broken)} of {len(audit.checks)} limits broken, {samples}"
    nearest = audit.nearest
    use = f", nearest {check_name(nearest)} {100 * nearest.ratio:.2f} %" if nearest else ""
    return f"passed, {samples}{use}"


def failure_sentence(audit: Audit) -> str:
    """The broken limits in one sentence of at most LONGEST characters."""
    failures = audit.failures
    for count in range(_FAILURES_SHOWN, 0, -1):
        more = len(failures) - count
        rest = f"; and {counted(more, 'limit')} more" if more > 0 else ""
        sentence = f"the audit failed: {'; '.join(failures[:count]) or 'nothing was checked'}{rest}"
        if len(sentence) <= LONGEST:
            break
    return sentence


_FAILURES_SHOWN = 3
AUDIT_HEADER = ("limit", "worst", "allowed", "use", "time s", "line", "verdict")


def audit_rows(audit: Audit) -> list[tuple[str, ...]]:
    """The checks as rows under `AUDIT_HEADER`."""
    return [
        (
            check_name(check),
            f"{check.worst:.6g}",
            f"{check.limit:.6g} {check.unit}".strip(),
            f"{100 * check.ratio:.2f} %" if math.isfinite(check.ratio) else "-",
            f"{check.time:.4f}",
            str(check.line or "-"),
            "not judged" if not check.judged else "holds" if check.ok else "BROKEN",
        )
        for check in audit.checks
        if not check.ok or math.isfinite(check.limit)
    ]


def comparison_table(
    rows: Sequence[Row], limits: Sequence[str]
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows of a comparison: one row for each method that has a plan, one column for each limit."""
    planned = [row for row in rows if row.plan is not None]
    limits = [name for name in limits if any(_is_limited(row.worst(name)) for row in planned)]
    saved = any(row.saved is not None for row in planned)
    today = ("saved s",) if saved else ()
    header = ("method", "time s", *today, "path's bound s", "gap", "computing", *limits, "audit")
    fastest = min((row.time for row in planned if row.time is not None), default=0.0)
    digits = 6 if fastest < 1e3 else 3
    body = [
        (
            row.method,
            f"{row.time:.{digits}f}",
            *((f"{row.saved:.3f}" if row.saved is not None else "-",) if saved else ()),
            f"{row.lower_bound:.{digits}f}",
            "-" if row.gap is None else f"{100 * row.gap:.3g} %",
            duration_text(row.plan.compute["plan"]) if row.plan else "",
            *(_use_text(row.worst(name)) for name in limits),
            "passed" if row.audit and row.audit.ok else "FAILED",
        )
        for row in planned
    ]
    return header, body


def _is_limited(check: LimitCheck | None) -> bool:
    return check is not None and math.isfinite(check.limit)


def _use_text(check: LimitCheck | None) -> str:
    """`99.99 %`; with the axis and the line if the limit is broken, in brackets if it is not judged."""
    if check is None or not math.isfinite(check.ratio):
        return "-"
    use = f"{100 * check.ratio:.4g} %"
    if check.ok:
        return use if check.judged else f"({use})"
    line = f"line {check.line}" if check.line else ""
    return f"{use} {' '.join(part for part in (check.axis, line) if part)}".rstrip()


def check_name(check: LimitCheck) -> str:
    """`X acceleration`, `feed`."""
    return f"{check.axis or ''} {check.name.replace('_', ' ')}".strip()
