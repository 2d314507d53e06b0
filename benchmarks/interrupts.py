"""Time from Ctrl-C to the prompt in each stage of a large plan, and time between reports of progress [s]."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.named import example
from benchmarks.results import Cell, Result
from feedplan import Machine, Plan
from feedplan.audit import audit
from feedplan.constraints.problem import build_problem
from feedplan.geometry.build import build_path
from feedplan.lower_bound import lower_bound
from feedplan.plan_folder import write_plan
from feedplan.planners import corners, limits_jerk, planner
from feedplan.program.read import read_program
from feedplan.progress import Listener, part
from feedplan.setpoints import Setpoints

METHODS = ("bang-bang", "s-curve", "jerk-limited")
PART, MACHINE, BLOCKS, QUICK = "head", "mill", 1_000_000, 1000
# Time between signals in a stage [s], and when the ending signal comes, as a share of the stage's time.
EVERY, MOMENT = 0.1, 0.5

Stage = Callable[[Listener], Any]


def run(quick: bool = False) -> Result:
    """Runs each stage twice: whole, with a listener and many signals, and in a child that a signal ends."""
    blocks = BLOCKS // (QUICK if quick else 1)
    rows: list[dict[str, Cell]] = []
    with tempfile.TemporaryDirectory() as directory:
        program = Path(directory, f"{PART}.ngc")
        program.write_text(example(PART).program(blocks), encoding="ascii")
        for method in METHODS[-1:] if quick else METHODS:
            for name, stage in _stages(program, Machine.load(MACHINE), method, Path(directory, "out")):
                rows.append({"method": method, "stage": name, **_measured(stage)})
    return Result(
        f"From Ctrl-C to the prompt in {blocks} blocks, {os.cpu_count()} cores",
        tuple(rows),
        (
            f"heard: from a signal to its handler, the worst of all, one every {EVERY} s.",
            "to end: from a Ctrl-C in the middle of the stage to the end of the process.",
            "silence: the longest time between two times that progress is told; back: how often it falls.",
        ),
    )


def _stages(program: Path, machine: Machine, method: str, output: Path) -> Iterator[tuple[str, Stage]]:
    """The stages of a plan in order; each uses the results of the stages before."""
    made: dict[str, Any] = {}

    def keep(name: str, make: Callable[[Listener], Any]) -> tuple[str, Stage]:
        return name, lambda progress: made.__setitem__(name, make(progress))

    yield keep("read", lambda progress: read_program(program, machine, progress=progress))
    yield keep(
        "fit",
        lambda progress: build_path(made["read"], machine, corners=corners(method), progress=progress),
    )
    problem = build_problem(made["fit"], machine)
    yield keep("plan", lambda progress: planner(method)(problem, progress=progress))  # type: ignore[call-arg]
    profile = made["plan"]
    yield keep("bound", lambda progress: lower_bound(problem, profile, progress))
    plan = Plan(made["read"], machine, problem, profile, method, made["bound"], {"plan": 0.0})

    def audited(progress: Listener) -> Any:
        points = Setpoints(problem, profile, machine.period, progress=part(progress, 0.0, 0.02))
        jerk = limits_jerk(method)
        rest = part(progress, 0.02, 1.0)
        return audit(problem, profile, machine, made["read"], points, jerk=jerk, progress=rest)

    yield keep("audit", audited)
    plan._verdict.append(made["audit"])
    write = partial(write_plan, plan, output)
    yield keep("write", lambda progress: write(progress=lambda _, done: progress(done)))


def _measured(stage: Stage) -> dict[str, Cell]:
    """Times a stage in this process, and the end of a forked child that gets Ctrl-C in the stage."""
    child = _child(stage)
    told: list[tuple[float, float]] = [(time.perf_counter(), 0.0)]
    with _signals() as late:
        stage(lambda done: told.append((time.perf_counter(), done)))
    told.append((time.perf_counter(), 1.0))
    seconds = told[-1][0] - told[0][0]
    pairs = list(pairwise(told))
    return {
        "stage [s]": seconds,
        "heard [s]": max(late, default=0.0),
        "to end [s]": _end(child, MOMENT * seconds),
        "told [1/s]": (len(told) - 2) / seconds,
        "silence [s]": max(after[0] - before[0] for before, after in pairs),
        "back": sum(after[1] < before[1] for before, after in pairs),
    }


@contextmanager
def _signals() -> Iterator[list[float]]:
    """Sends this process a signal every `EVERY` seconds; collects the delay until each is handled [s].
    Signals that come while an earlier one waits are not counted."""
    late: list[float] = []
    start, handled = time.perf_counter(), 0

    def handle(*_: object) -> None:
        nonlocal handled
        now = time.perf_counter() - start
        late.append(now - (handled + 1) * EVERY)
        handled = int(now / EVERY)

    before = signal.signal(signal.SIGALRM, handle)
    signal.setitimer(signal.ITIMER_REAL, EVERY, EVERY)
    try:
        yield late
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _child(stage: Stage) -> tuple[int, int]:
    """Forks a child that runs the stage when a byte comes through the pipe; its id and the pipe's end."""
    sys.stdout.flush()
    out, into = os.pipe()
    heard, ready = os.pipe()
    child = os.fork()
    if child:
        os.close(out)
        os.close(ready)
        os.read(heard, 1)
        os.close(heard)
        return child, into
    os.close(into)
    code = 1
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        os.write(ready, b".")
        os.read(out, 1)
        stage(lambda done: None)
        code = 0
    except KeyboardInterrupt:
        code = 130
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def _end(child: tuple[int, int], moment: float) -> float:
    """Starts the child's stage and interrupts it after `moment` seconds: the time until the child has ended
    [s]; 0 if the stage was done before."""
    process, into = child
    os.write(into, b".")
    os.close(into)
    time.sleep(moment)
    sent = time.perf_counter()
    os.kill(process, signal.SIGINT)
    _, status = os.waitpid(process, 0)
    seconds = time.perf_counter() - sent
    code = os.waitstatus_to_exitcode(status)
    if code not in (0, 130):
        raise RuntimeError(f"a child ended with {code}")
    return seconds if code == 130 else 0.0
