"""One job in a process of its own: reads, plans, audits, writes, and tells how far it is.

The server and this process exchange lines of JSON, never pickled objects. The process ends by itself when its
server is gone, and stops at the next word of progress when it is told to.
"""

from __future__ import annotations

import io
import json
import os
import signal
import threading
import time
import traceback
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path as FilePath
from typing import Any

from feedplan.errors import FeedplanError, ProgramError
from feedplan.files import write_plan
from feedplan.machine.file import parse
from feedplan.planning import Plan, plan
from feedplan.program.machine_for import AUTO, smallest_machine
from feedplan.program.program import Program
from feedplan.program.read import Reading, read_program
from feedplan.service.limits import Limits
from feedplan.service.refusals import DISK, LIMIT, Refusal, kind_of
from feedplan.service.requests import READING
from feedplan.service.store import sync

# Where each stage begins and ends in the whole work.
STAGES = {
    "read": (0.0, 0.1),
    "fit": (0.1, 0.25),
    "plan": (0.25, 0.6),
    "audit": (0.6, 0.8),
    "write": (0.8, 1.0),
}
# Progress is told so often [s], and where a stage begins.
EVERY = 0.25
# How much later than the server the system hands this process time.
NICENESS = 10
# What most jobs import; the fork server has it before they begin. `__main__` is that of the command.
LOADED = (
    __name__,
    *("feedplan.__main__", "feedplan.machine.kinematics", "feedplan.planners.bang_bang"),
    *("feedplan.planners.jerk_limited", "feedplan.program.tip", "feedplan.report.page"),
)
MOST_FAILURES, MOST_WARNINGS = 5, 20


class Stopped(Exception):  # noqa: N818 (nothing went wrong)
    """The server does not want the work any more."""


def main(connection: Connection, folder: str, attempt: int, order: str, limits: Limits) -> None:
    """Plans the job in a folder and tells the outcome: the last line has `result`, `problem`, `stopped` or
    `defect`."""
    _become_a_worker()
    talk = _Talk(connection)
    try:
        outcome: dict[str, Any] = {
            "result": _planned(FilePath(folder), attempt, json.loads(order), limits, talk)
        }
    except Stopped:
        outcome = {"stopped": True}
    except Refusal as refusal:
        outcome = {"problem": refusal.text()}
    except MemoryError:
        said = "the memory of the computer does not suffice below max_memory: split the program"
        outcome = {"problem": Refusal(LIMIT, said, limit=limits.named_in(said)).text()}
    except Exception as error:
        defect = f"{type(error).__name__}: {error}"
        outcome = {"defect": defect[:500], "traceback": traceback.format_exc()[-4000:]}
    talk.send(outcome)
    # Nothing of this process is worth an orderly end, and a defect could make that long.
    os._exit(0)


def _become_a_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What solvers print goes nowhere.
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nothing, stream)
    with suppress(OSError):
        os.nice(NICENESS)
    with suppress(OSError):  # Linux: this process, not the server, is ended where memory runs out
        FilePath("/proc/self/oom_score_adj").write_text("1000")


class _Talk:
    """The line to the server: progress as it goes on, and what it says."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._told = ("", 0.0)
        self._stop = threading.Event()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        try:
            self._connection.recv_bytes(16)
        except (EOFError, OSError):  # the server is gone
            os._exit(1)
        self._stop.set()

    def send(self, message: Mapping[str, Any]) -> None:
        with suppress(OSError):
            self._connection.send_bytes(json.dumps(message).encode())

    def progress(self, stage: str, done: float) -> None:
        """Tells the server, some times a second. Raises Stopped when it said so."""
        if self._stop.is_set():
            raise Stopped
        now = time.monotonic()
        last_stage, last = self._told
        if stage in STAGES and (stage != last_stage or now - last >= EVERY):
            self._told = (stage, now)
            start, end = STAGES[stage]
            self.send({"stage": stage, "part": done, "done": start + (end - start) * done})


class _Named(io.BytesIO):
    """A program as a stream; it is not a file, so that it calls no files either."""

    def __init__(self, content: bytes, name: str) -> None:
        super().__init__(content)
        self.name = name


def _planned(
    folder: FilePath, attempt: int, order: Mapping[str, Any], limits: Limits, talk: _Talk
) -> dict[str, Any]:
    """Plans and writes; returns the key figures. Raises Refusal where there is no plan."""
    name = order["name"]
    options = dict(order["options"])
    reading = Reading(max_moves=limits.max_moves)
    for key in READING:
        if key in options:
            reading[key] = options.pop(key)  # type: ignore[literal-required]
    if order["has_tools"]:
        reading["tool_table"] = folder / "tools.tbl"
    # What a client asks for is within the limit of the service.
    limits = replace(limits, max_setpoints=options.setdefault("max_setpoints", limits.max_setpoints))
    content = (folder / "program").read_bytes()
    try:
        source: Program | io.BytesIO = _Named(content, name)
        if order["machine"] == AUTO:
            machine, source = smallest_machine(
                lambda known: read_program(content, known, name=name, feed=options.get("feed"), **reading)
            )
        else:
            machine = parse(order["machine"], "of the request")
        made = plan(source, machine, order["method"], reading=reading, progress=talk.progress, **options)
        made.audit(talk.progress)
        result = folder / f"result-{attempt}"
        for file in write_plan(made, result, ("npz",), drawing=True, progress=talk.progress):
            sync(file)
        sync(result)
        sync(folder)
        return _figures(made)
    except FeedplanError as error:
        raise _refusal(error, name, folder, limits) from error


def _refusal(error: FeedplanError, name: str, folder: FilePath, limits: Limits) -> Refusal:
    """The problem that an error is, without the place of the store."""
    if isinstance(error.__cause__, OSError):
        said = "the result cannot be written, the disk of the service is full or broken: tell its operator"
        return Refusal(DISK, said)
    sentence = str(error).replace(f"{folder}{os.sep}", "")
    limit = limits.named_in(sentence)
    line = getattr(error, "line", None)
    file = name if line is not None or isinstance(error, ProgramError) else None
    return Refusal(LIMIT if limit else kind_of(error), sentence, file=file, line=line, limit=limit)


def _figures(made: Plan) -> dict[str, Any]:
    summary, verdict = made.summary(), made.audit()
    return {
        **{name: summary[name] for name in ("time", "lower_bound", "gap", "machine", "setpoints")},
        "ok": verdict.ok,
        "failures": list(verdict.failures[:MOST_FAILURES]),
        "warnings": list(made.warnings[:MOST_WARNINGS]),
    }
