"""Writes the files of a plan (plan.json, setpoints, report) and of a comparison, completely or not at all."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from functools import partial
from numbers import Real
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from feedplan.arguments import callback, file_path, flag, instance, list_of_names, refuse
from feedplan.errors import InputError
from feedplan.outputs import KNOTS, SETPOINTS, FormatName, Header, files_in, formats_named
from feedplan.outputs._staging import require_folder, staged
from feedplan.program.source import require_other
from feedplan.progress import Listener, Progress, beside, of_stage, part, tell
from feedplan.setpoints import SetpointChunk, Sink
from feedplan.units import duration_text

if TYPE_CHECKING:
    from feedplan.comparison import Row
    from feedplan.knots import Knots
    from feedplan.one_step_more import Step
    from feedplan.planned_feeds.rewrite import PlannedProgram
    from feedplan.planning import Plan

SUMMARY_FILE = "plan.json"
PROGRAM_FILE = "program.ngc"
DRAWING_FILE = "drawing.bin"
COMPARISON_FILE = "comparison.json"
_ROWS_AT_ONCE = 10_000
# Shares of progress: LENGTHS is the part of reading setpoints for the lengths of the path; SAMPLED is the
# part of writing for the setpoints, if the audit was made before.
LENGTHS, SAMPLED = 0.05, 0.75


def write_plan(
    plan: Plan,
    folder: str | os.PathLike[str],
    formats: Sequence[FormatName] = ("npz",),
    *,
    program: PlannedProgram | None = None,
    step: float | None = None,
    drawing: bool = False,
    one_step_more: Sequence[Step] = (),
    progress: Progress | None = None,
) -> tuple[FilePath, ...]:
    """Writes the plan, its setpoints in these formats (none for ()), and its report; returns the files.

    `program`, from `feedplan.planned_program`, is written as program.ngc. `one_step_more`, from
    `feedplan.one_step_more.one_step_more`, is added to plan.json and the report. `step` [s] is the longest
    step of a pvt table, which needs it. With `drawing` the data of the service's page is written as
    drawing.bin. `progress` is called with a stage and the finished share of it (0 to 1).

    All files are written to a temporary folder and renamed at the end, so `folder` never contains a part of a
    plan; other files in it stay. Raises InputError if the files cannot be written, or if the plan's own
    program would be overwritten.
    """
    from feedplan.report.container import contained
    from feedplan.report.figures import SetpointFigures, chart_data
    from feedplan.report.page import FILE as REPORT_FILE
    from feedplan.report.page import write_report
    from feedplan.report.tool_path import MANY_POINTS, POINTS, ToolPath

    formats = list_of_names(formats, "formats", "a list of names, such as ['npz', 'csv']")  # type: ignore[assignment]
    folder = file_path(folder, "the folder", "the path of a folder, as a text or a pathlib.Path")
    require_folder(folder)
    callback(progress)
    if not callable(getattr(plan, "summary", None)):
        raise refuse("the plan", plan, "what feedplan.plan returns")
    outputs = formats_named(formats)
    if program is not None:
        from feedplan.planned_feeds.rewrite import PlannedProgram

        instance(program, PlannedProgram, "the program", "what feedplan.planned_program returns")
    if plan.program is not None:
        own = [SUMMARY_FILE, *([] if program is None else [PROGRAM_FILE])]
        own += [output.FILE for output in outputs.values()]
        require_other(plan.program.text, *(folder / name for name in own))
    flag(drawing, "the drawing")
    steps = _steps(one_step_more)
    knots = _knots(plan, [name for name, output in outputs.items() if output.ROWS == KNOTS], step)
    share = of_stage(progress, "write")
    # Setpoints are computed once: in the stage of the audit if it has not been made, else in that of writing.
    reading, begun = (
        (part(share, 0.0, SAMPLED), SAMPLED) if plan.audited else (of_stage(progress, "audit"), 0.0)
    )
    tell(reading, 0.0)
    tool_path = ToolPath(plan.problem, MANY_POINTS if drawing else POINTS)
    tell(reading, LENGTHS)
    setpoints = plan.setpoints()
    units = tuple(plan.machine.axis(name).unit for name in setpoints.axes)
    header = Header(setpoints.axes, units, setpoints.period, setpoints.events)
    figures = SetpointFigures(plan.problem, tool_path, setpoints.count)
    with staged(folder, last=SUMMARY_FILE) as stage:
        with beside(partial(_along_path, plan)) as along_path, ExitStack() as stack:
            sinks = [
                stack.enter_context(output.writer(stage / output.FILE, header, setpoints.count))
                for output in outputs.values()
                if output.ROWS == SETPOINTS
            ]
            passed_on = stack.enter_context(_passing_on((*sinks, figures.add)))
            audit = plan.pass_setpoints((passed_on,), part(reading, LENGTHS, 1.0))
        over_length, account = along_path.result(), plan.account
        for check in audit.broken:
            tool_path.mark(setpoints.around(check.time), check.time)
        share = part(share, begun, 1.0)
        tell(share, 0.0)
        summary = plan.summary()
        if program is not None:
            (stage / PROGRAM_FILE).write_bytes(program.content)
            summary["planned_program"] = {"file": PROGRAM_FILE, **program.to_json()}
        if steps:
            summary["one_step_more"] = [more.to_json() for more in steps]
        if knots is not None:
            summary[KNOTS] = {"count": knots.count, "step": knots.step}
            header = Header(knots.axes, units, knots.step, plan.events)
            for output in outputs.values():
                if output.ROWS == KNOTS:
                    with output.writer(stage / output.FILE, header, knots.count) as add:
                        for chunk in knots.chunks(_ROWS_AT_ONCE):
                            add(chunk)
        # For path files and drawings, the numbers of curves and entities are no lines of a file.
        has_lines = plan.program is not None and plan.program.reading is not None
        data = chart_data(plan.problem, account, figures, audit, over_length)
        data["has_lines"] = has_lines
        if drawing:
            (stage / DRAWING_FILE).write_bytes(contained(data))
            data["path"] = tool_path.data(account.activity, POINTS)
        write_report(
            stage / REPORT_FILE,
            summary=summary,
            problem=plan.problem,
            account=account,
            audit=audit,
            data=data,
            text=plan.program.text if plan.program and has_lines else None,
        )
        (stage / SUMMARY_FILE).write_text(summary_text(summary), encoding="utf-8")
        names = sorted(file.name for file in stage.iterdir())
    tell(share, 1.0)
    return tuple(folder / name for name in names)


def _along_path(plan: Plan, progress: Listener) -> dict[str, Any]:
    """Makes the account of a plan, which keeps it, then the curves over length; it needs no setpoints."""
    from feedplan.report.figures import over_length

    plan.make_account(part(progress, 0.0, 0.5))
    return over_length(plan.problem, plan.profile, part(progress, 0.5, 1.0))


@contextmanager
def _passing_on(sinks: Sequence[Sink]) -> Iterator[Sink]:
    """Passes chunks to the sinks on a second thread, while the next chunk is computed and audited.

    At most two chunks are in memory. An exception of a sink is raised by the next call or at the end.
    """
    last: Future[None] | None = None

    def to_all(chunk: SetpointChunk) -> None:
        for sink in sinks:
            sink(chunk)

    def pass_on(chunk: SetpointChunk) -> None:
        nonlocal last
        if last is not None:
            last.result()
        last = thread.submit(to_all, chunk)

    with ThreadPoolExecutor(1, "files") as thread:
        yield pass_on
        if last is not None:
            last.result()


def files_of_plan(folder: FilePath) -> list[FilePath]:
    """The files in a folder that belong to its plan: setpoints, and the program."""
    program = folder / PROGRAM_FILE
    return [*files_in(folder), *([program] if program.exists() else [])]


def _knots(plan: Plan, names: list[str], step: float | None) -> Knots | None:
    """The knots for these formats; None if none needs them. Raises InputError if the step does not fit."""
    if step is None and names:
        raise InputError(f"{names[0]} has no step: give its longest one [s], --step on the command line")
    if step is None:
        return None
    if not names:
        raise refuse("the step", step, "it with the format pvt alone")
    return plan.knots(step)


def write_comparison(
    rows: Sequence[Row], folder: FilePath, summary: dict[str, Any], progress: Progress | None = None
) -> tuple[FilePath, ...]:
    """Writes a comparison's numbers (`summary`) and its page; returns the files.

    Both are written completely or not at all. Raises InputError if they cannot be written, or if the program
    would be overwritten.
    """
    from feedplan.comparison import LIMITS
    from feedplan.report.comparison import FILE as PAGE_FILE
    from feedplan.report.comparison import write_comparison as write_page
    from feedplan.report.tool_path import ToolPath

    for row in rows:
        if row.plan is not None and row.plan.program is not None:
            require_other(row.plan.program.text, folder / COMPARISON_FILE)
    paths, shown = [], []
    for number, row in enumerate(rows):
        entry: dict[str, Any] = {"method": row.method, "time": row.time, "error": row.error}
        if row.plan is not None:
            tool = ToolPath(row.plan.problem)
            for chunk in row.plan.setpoints().chunks(_ROWS_AT_ONCE):
                tool.add(chunk)
            paths.append({"method": row.method, **tool.data(row.plan.account.activity)})
            entry |= {
                "gap": row.gap,
                "computing": row.plan.compute["plan"],
                "audit": row.plan.audit().ok,
                "worst": {limit: row.worst(limit) for limit in LIMITS},
            }
        shown.append(entry)
        if progress:
            progress("write", (number + 1) / len(rows))
    about = {name: summary[name] for name in ("machine", "program")}
    if today := summary["today"]:
        about["today"] = f"{duration_text(today['time'])} by {today['controller']}"
    with staged(folder, last=COMPARISON_FILE) as stage:
        write_page(
            stage / PAGE_FILE,
            title=FilePath(summary["program"]).name,
            about=about,
            rows=shown,
            limits=LIMITS,
            paths=paths,
        )
        (stage / COMPARISON_FILE).write_text(summary_text(summary), encoding="utf-8")
        names = sorted(file.name for file in stage.iterdir())
    return tuple(folder / name for name in names)


def _steps(given: Sequence[Step]) -> tuple[Step, ...]:
    from feedplan.one_step_more import Step

    if isinstance(given, (list, tuple)) and all(isinstance(step, Step) for step in given):
        return tuple(given)
    raise refuse("one_step_more", given, "what feedplan.one_step_more.one_step_more returns")


def summary_text(summary: dict[str, Any]) -> str:
    """A summary as JSON; numbers that are not finite become null."""
    return json.dumps(_plain(summary), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if hasattr(value, "item"):  # a numpy scalar
        value = value.item()
    if isinstance(value, Real) and not isinstance(value, int):
        value = float(value)
    return None if isinstance(value, float) and not math.isfinite(value) else value
