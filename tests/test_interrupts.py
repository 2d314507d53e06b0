"""Signals and progress listeners can end every stage of the work; progress never decreases."""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan import Machine, Plan
from feedplan.cli import main, terminal
from feedplan.constraints.problem import build_problem
from feedplan.geometry.build import build_path
from feedplan.geometry.corners import Corners
from feedplan.outputs import FormatName
from feedplan.plan_folder import write_plan
from feedplan.planners import planner
from feedplan.program.gcode import read_gcode
from feedplan.program.read import read_program

ROOT = Path(__file__).parent.parent
Progress = Callable[[str, float], None]


class StoppedError(Exception):
    """Raised by a listener."""


def wave(blocks: int) -> str:
    """A program of short blocks along a wave that does not repeat."""
    i = np.arange(blocks)
    x, y = 0.05 * i, 3.0 * np.sin(0.05 * i) + np.sin(0.013 * i)
    moves = "\n".join(f"X{a:.4f} Y{b:.4f}" for a, b in zip(x, y, strict=True))
    return f"G21 G90 G64 P0.01\nG1 F3000\n{moves}\nM2\n"


@pytest.fixture(scope="module")
def machine() -> Machine:
    axes = tuple(feedplan.Axis(name, 250.0, 3000.0, 50_000.0) for name in "XY")
    return Machine(name="wave", axes=axes)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program with several reports of progress in each stage."""
    place = tmp_path_factory.mktemp("wave") / "wave.ngc"
    place.write_text(wave(20_000), encoding="ascii")
    return place


@pytest.fixture(scope="module")
def long_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A program long enough for reports of progress while it is read."""
    place = tmp_path_factory.mktemp("wave") / "long.ngc"
    place.write_text(wave(300_000), encoding="ascii")
    return place


def everything(file: Path, machine: Machine, method: str, folder: Path, progress: Progress) -> Plan:
    plan = feedplan.plan(file, machine, method, progress=progress)
    plan.audit(progress)
    write_plan(plan, folder, progress=progress)
    return plan


@pytest.mark.parametrize("method", ["bang-bang", "s-curve", "jerk-limited"])
def test_progress_rises_from_0_to_1_in_each_stage(
    file: Path, machine: Machine, method: str, tmp_path: Path
) -> None:
    told: list[tuple[str, float]] = []
    everything(file, machine, method, tmp_path / "out", lambda stage, done: told.append((stage, done)))
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert stages == ["read", "fit", "plan", "audit", "write"]
    assert [stages.index(stage) for stage, _ in told] == sorted(stages.index(stage) for stage, _ in told)
    for stage in stages:
        shares = [done for name, done in told if name == stage]
        assert shares == sorted(shares)
        assert shares[0] < 0.1, stage
        assert shares[-1] == 1.0, stage
    if method == "jerk-limited":
        assert sum(stage == "plan" and 0 < done < 1 for stage, done in told) > 5


@pytest.mark.parametrize("form", ["csv", "npz"])
def test_fit_and_check_show_how_far_they_are(
    form: FormatName, file: Path, machine: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both commands report progress, and a listener can end the check."""
    machine_file = tmp_path / "wave.toml"
    machine_file.write_text(machine.to_toml(), encoding="utf-8")
    write_plan(feedplan.plan(file, machine, "s-curve"), tmp_path / "out", [form])
    told: list[tuple[str, float]] = []

    @contextmanager
    def listening(quiet: bool) -> Iterator[Progress]:
        yield lambda stage, done: told.append((stage, done))

    monkeypatch.setattr(terminal, "progress_bar", listening)
    for command, stages in (
        (["fit", str(file), "-m", str(machine_file), "--smooth"], ["fit"]),
        (["check", str(tmp_path / "out")], ["read", "audit"]),
    ):
        told.clear()
        assert main(command) == 0
        assert [stage for stage in dict.fromkeys(stage for stage, _ in told) if stage in stages] == stages
        for stage in stages:
            shares = [done for name, done in told if name == stage]
            assert shares == sorted(shares)
            assert shares[0] < 0.1
            assert shares[-1] == 1.0

    def stop(stage: str, done: float) -> None:
        if stage == "audit" and 0 < done < 1:
            raise StoppedError

    with pytest.raises(StoppedError):
        feedplan.check(tmp_path / "out", progress=stop)


@pytest.mark.parametrize("stage", ["fit", "plan", "audit", "write"])
def test_a_listener_can_end_its_stage(file: Path, machine: Machine, stage: str, tmp_path: Path) -> None:
    told: list[tuple[str, float]] = []

    def stop(name: str, done: float) -> None:
        told.append((name, done))
        if name == stage and 0 < done < 1:
            raise StoppedError

    with pytest.raises(StoppedError):
        everything(file, machine, "jerk-limited", tmp_path / "out", stop)
    assert told[-1][0] == stage
    assert told[-1][1] < 1
    assert list(tmp_path.iterdir()) == []


def test_the_reader_is_ended_too(long_file: Path, machine: Machine) -> None:
    told: list[float] = []

    def stop(done: float) -> None:
        told.append(done)
        if done > 0:
            raise StoppedError

    with pytest.raises(StoppedError):
        read_program(long_file, machine, progress=stop)
    assert told[:-1] == [0.0] * (len(told) - 1)
    assert 0 < told[-1] < 1


def spent(work: Callable[[], Any], until: float = 0.0) -> float:
    """Processor time until the work ends [s]; a signal comes after the time `until` [s], unless it is 0."""
    before = signal.signal(signal.SIGPROF, signal.default_int_handler)
    begun = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, until)
    try:
        work()
    except KeyboardInterrupt:
        pass
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    return time.process_time() - begun


@pytest.mark.skipif(threading.current_thread() is not threading.main_thread(), reason="signals need it")
def test_a_signal_ends_native_work_long_before_it_is_done(file: Path, machine: Machine) -> None:
    path = build_path(read_program(file, machine), machine, corners=Corners.SMOOTH)
    problem = build_problem(path, machine)
    longer = read_gcode(wave(160_000), machine)
    for work in (
        lambda: build_path(longer, machine, corners=Corners.SMOOTH),
        lambda: planner("jerk-limited")(problem),
        lambda: planner("s-curve")(problem),
    ):
        # Processor time, because other work may run on the computer. If the signal had no effect, both times
        # would be equal.
        whole = spent(work)
        assert spent(work, 0.1 * whole) < 0.7 * whole


def test_threads_that_plan_at_once_do_not_disturb_each_other(file: Path, machine: Machine) -> None:
    alone = feedplan.plan(file, machine, "s-curve").time
    found: dict[int, Any] = {}

    def work(number: int) -> None:
        def listen(stage: str, done: float) -> None:
            if number == 0 and stage == "plan" and done > 0:
                raise StoppedError

        try:
            found[number] = feedplan.plan(file, machine, "s-curve", progress=listen).time
        except StoppedError:
            found[number] = StoppedError

    threads = [threading.Thread(target=work, args=(number,)) for number in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {0: StoppedError, 1: alone, 2: alone}


def test_the_bars_of_the_command_move_and_a_signal_ends_it(tmp_path: Path) -> None:
    """On a terminal: the bar moves; after the signal one line is printed and no file is left."""
    program = tmp_path / "wave.ngc"
    program.write_text(wave(60_000), encoding="ascii")
    master, slave = pty.openpty()
    command = [sys.executable, "-m", "feedplan", "plan", str(program), "--method", "jerk-limited"]
    with (tmp_path / "results").open("wb") as results:
        process = subprocess.Popen(
            [*command, "-o", str(tmp_path / "out")],
            cwd=ROOT,
            env=dict(os.environ, TERM="xterm", COLUMNS="100"),
            stdout=results,
            stderr=slave,
            # Processes that are started in the background ignore this signal.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
    os.close(slave)
    shown, sent = "", False
    while process.poll() is None or select.select([master], [], [], 0)[0]:
        if select.select([master], [], [], 0.1)[0]:
            try:
                shown += os.read(master, 65536).decode("utf-8", "replace")
            except OSError:
                break
        if not sent and re.search(r"plan\b[^%]*\b[1-9]\d? %", re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown)):
            sent = True
            process.send_signal(signal.SIGINT)
    os.close(master)
    assert process.wait() == 130
    assert sent
    assert shown.rstrip().endswith("error: interrupted")
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["results", "wave.ngc"]
    assert (tmp_path / "results").stat().st_size == 0


def test_the_fork_server_leaves_ctrl_c_to_the_command() -> None:
    """It imports feedplan when it starts: a Ctrl-C that reached it would print a traceback."""
    code = """
import signal
from multiprocessing import forkserver
from pathlib import Path
from feedplan.jobs.executor import JobLimits
from feedplan.jobs.processes import Processes
Processes(1, JobLimits(max_time=60.0, max_memory=4000.0))
status = Path(f"/proc/{forkserver._forkserver._forkserver_pid}/status").read_text()
blocked = int(next(line for line in status.splitlines() if line.startswith("SigBlk")).split()[1], 16)
print(blocked >> (signal.SIGINT - 1) & 1, signal.pthread_sigmask(signal.SIG_BLOCK, ()))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("1 set()\n", "")
