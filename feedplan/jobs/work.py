"""Plans one job: reads, plans, audits, writes. Every executor calls it."""

from __future__ import annotations

import io
import time
from typing import Any

from feedplan.jobs.order import Job
from feedplan.jobs.outcome import Outcome
from feedplan.machine.machine import Machine
from feedplan.plan_folder import write_plan
from feedplan.planning import Plan, plan
from feedplan.program.machine_for import AUTO, smallest_machine
from feedplan.program.program import Program
from feedplan.program.read import Reading, read_program
from feedplan.program.source import content_of
from feedplan.progress import Progress

# Begin and end of each stage in the whole work (0 to 1).
STAGES = {
    "read": (0.0, 0.1),
    "fit": (0.1, 0.25),
    "plan": (0.25, 0.6),
    "audit": (0.6, 0.8),
    "write": (0.8, 1.0),
}
# Time between two reports of progress [s]; the first report of each stage is always passed on.
EVERY = 0.25
MOST_FAILURES, MOST_WARNINGS = 5, 20


class Stopped(Exception):  # noqa: N818 (nothing went wrong)
    """The job was told to stop."""


class _Named(io.BytesIO):
    """A program as a stream instead of a file, so that it cannot call files in its own folder."""

    def __init__(self, content: bytes, name: str) -> None:
        super().__init__(content)
        self.name = name


def work_on(job: Job, progress: Progress) -> Outcome:
    """Plans a job and writes its plan; errors are in the outcome. `progress` may raise Stopped."""
    start = time.perf_counter()
    order = job.order
    reading = Reading(**order.reading)  # type: ignore[typeddict-item]
    if job.tool_table is not None:
        reading["tool_table"] = job.tool_table
    if job.subprograms:
        reading["subprograms"] = job.subprograms
    method: Any = order.method
    formats: Any = order.formats
    try:
        content = content_of(job.program).content
        source: Program | io.BytesIO = _Named(content, order.name)
        if order.machine == AUTO:
            feed = order.options.get("feed")
            machine, source = smallest_machine(
                lambda known: read_program(content, known, name=order.name, feed=feed, **reading)
            )
            reading = Reading()  # the program has been read
        else:
            machine = Machine.from_toml(order.machine, "of the order")
        made = plan(source, machine, method, reading=reading, progress=progress, **order.options)
        files = write_plan(made, job.folder, formats, drawing=order.drawing, progress=progress)
        size = sum(file.stat().st_size for file in files)
        return Outcome("done", _figures(made), seconds=time.perf_counter() - start, size=size)
    except Stopped:
        return Outcome("stopped")
    except Exception as error:
        return Outcome.of_error(error, time.perf_counter() - start)


def _figures(made: Plan) -> dict[str, Any]:
    summary, verdict = made.summary(), made.audit()
    names = ("time", "lower_bound", "gap", "machine", "setpoints")
    return {
        **{name: summary[name] for name in names},
        "ok": verdict.ok,
        "failures": list(verdict.failures[:MOST_FAILURES]),
        "warnings": list(made.warnings[:MOST_WARNINGS]),
    }


def paced(tell: Progress) -> Progress:
    """A progress function that calls `tell` at most every EVERY seconds, and at the start of a stage."""
    told, last = "", 0.0

    def report(stage: str, part: float) -> None:
        nonlocal told, last
        now = time.monotonic()
        if stage in STAGES and (stage != told or now - last >= EVERY):
            told, last = stage, now
            tell(stage, part)

    return report


def of_whole(stage: str, part: float) -> float:
    """The finished share of the whole work when the share `part` of a stage is finished."""
    start, end = STAGES[stage]
    return start + (end - start) * part
