"""`feedplan.Client` and the command line's `--server` give the same results as without a service."""

from __future__ import annotations

import inspect
import io
import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan.audit.verdict import Audit
from feedplan.cli import main
from feedplan.machine.controller import Controller
from tests.service.servers import PART, Server, long_part

NAMES = ("t", "position", "velocity", "acceleration", "jerk", "line")
# Rows that differ between computers, or that a service does not have.
OWN = ("computing", "files")


@pytest.fixture
def client(server: Server) -> feedplan.Client:
    return feedplan.Client(server.url)


@pytest.fixture
def part(tmp_path: Path) -> Path:
    file = tmp_path / "part.ngc"
    file.write_bytes(PART)
    return file


@pytest.mark.parametrize(("name", "local"), [("plan", feedplan.plan), ("compare", feedplan.compare)])
def test_the_calls_are_those_of_the_package(name: str, local: Any) -> None:
    def parameters(function: Any) -> list[tuple[str, Any, Any]]:
        known = inspect.signature(function).parameters.values()
        # A service chooses its own cluster.
        others = ("self", "elsewhere")
        return [(own.name, own.kind, own.default) for own in known if own.name not in others]

    assert parameters(getattr(feedplan.Client, name)) == parameters(local)


def test_a_plan_is_the_same(client: feedplan.Client, part: Path, tmp_path: Path) -> None:
    told = []
    options: dict[str, Any] = {"tolerance": 0.02, "accuracy": 1e-3, "controller": "grbl"}
    plan = client.plan(part, "mill", "jerk-limited", **options, progress=lambda *args: told.append(args))
    local = feedplan.plan(part, "mill", "jerk-limited", **options)
    assert (plan.time, plan.lower_bound, plan.gap) == (local.time, local.lower_bound, local.gap)
    assert (plan.method, plan.warnings) == (local.method, local.warnings)
    assert plan.summary()["today"] == json.loads(json.dumps(local.summary()["today"]))
    assert plan.options == json.loads(json.dumps(local.options))
    assert plan.audit() == local.audit()
    assert {stage for stage, _ in told} == {"read", "fit", "plan", "audit", "write"}
    points, expected = plan.setpoints(), local.setpoints()
    assert (points.axes, points.count, points.duration) == (expected.axes, expected.count, expected.duration)
    whole = expected.all()
    chunks = list(points.chunks(100))
    assert sum(map(len, chunks)) == len(points) == len(whole)
    for name in NAMES:
        assert np.array_equal(
            np.concatenate([getattr(chunk, name) for chunk in chunks]), getattr(whole, name)
        )
    files = client.write_plan(plan, tmp_path / "out", ["npz", "csv"])
    assert files == feedplan.write_plan(local, tmp_path / "own", ["npz", "csv"]) or [
        f.name for f in files
    ] == [
        "plan.json",
        "report.html",
        "setpoints.csv",
        "setpoints.npz",
    ]
    assert feedplan.check(tmp_path / "out").ok
    assert (tmp_path / "out" / "setpoints.csv").read_bytes() == (
        tmp_path / "own" / "setpoints.csv"
    ).read_bytes()
    assert "part.ngc" in plan.report()
    with pytest.raises(feedplan.InputError, match=r"the period is 0\.002: give 0.001 s, that of the plan"):
        plan.setpoints(period=0.002)


def test_a_program_and_a_machine_may_have_any_documented_type(client: feedplan.Client, part: Path) -> None:
    mine = feedplan.Machine.load("mill").with_period(0.002)
    time = feedplan.plan(part, mine).time
    program = feedplan.read_program(part, mine)
    for source in (PART, PART.decode(), io.BytesIO(PART), part, str(part), program):
        assert client.plan(source, mine).time == time
    with pytest.raises(feedplan.InputError, match="a Path stays on this computer"):
        client.plan(feedplan.Path.from_points([[0, 0, 0], [1, 0, 0]], 0.01), "mill")  # type: ignore[arg-type]
    with pytest.raises(
        feedplan.InputError, match="the service takes no subprograms: give the program as one"
    ):
        client.plan(part, "mill", reading={"subprograms": ["."]})


@pytest.mark.parametrize(
    ("program", "machine", "options"),
    [
        ("G1 X1 F0\n", "mill", {}),
        ("%\n", "mill", {}),
        ("G1 F100 X10\nM2\n", "mill", {"end_speed": 1e6}),
        ("G1 F100 X10\nM2\n", "mill", {"accuracy": 0.1}),
        ("G1 F100 A10\nM2\n", "mill", {}),
    ],
)
def test_errors_are_the_same(
    client: feedplan.Client, program: str, machine: str, options: dict[str, Any]
) -> None:
    with pytest.raises(feedplan.FeedplanError) as here:
        feedplan.plan(program, machine, **options)
    with pytest.raises(type(here.value), match=f"^{re.escape(str(here.value))}$") as there:
        client.plan(program, machine, **options)
    assert getattr(there.value, "line", None) == getattr(here.value, "line", None)


def test_an_audit_is_the_same_on_axes_of_other_units() -> None:
    axes = [feedplan.Axis(name, 2.0, 10.0, unit="rad") for name in ("j1", "j2")]
    path = feedplan.Path.from_points([[0.0, 0.0], [1.0, 2.0]], 0.01, axes=["j1", "j2"])
    audit = feedplan.plan(path, feedplan.Machine("arm", tuple(axes))).audit()
    again = Audit.from_json(json.loads(json.dumps(audit.to_json())), {"j1": "rad", "j2": "rad"}, "rad")
    assert again.ok == audit.ok
    assert again.checked_samples == audit.checked_samples
    for ours, own in zip(again.checks, audit.checks, strict=True):
        assert (ours.sentence(), ours.ok, ours.judged) == (own.sentence(), own.ok, own.judged)


def test_methods_are_compared(client: feedplan.Client, part: Path) -> None:
    # The machine has no limits of jerk, but one of the methods needs them.
    mill = feedplan.Machine.load("mill")
    mine = replace(mill, axes=tuple(replace(axis, max_jerk=math.inf) for axis in mill.axes))
    methods = ["bang-bang", "s-curve"]
    ours, own = (where.compare(part, mine, methods, tolerance=0.02) for where in (client, feedplan))
    assert ours[1].error
    for one, other in zip(ours, own, strict=True):
        assert (one.method, one.time, one.error) == (other.method, other.time, other.error)
        assert one.audit == other.audit


def test_a_comparison_takes_a_controller_as_an_object(client: feedplan.Client, part: Path) -> None:
    controller = Controller("grbl", {"junction_deviation": 0.02})
    (ours,), (own,) = (
        where.compare(part, "mill", ["bang-bang"], controller=controller) for where in (client, feedplan)
    )
    assert (ours.error, ours.time) == (None, own.time)
    assert ours.plan.summary()["today"]["time"] == own.plan.summary()["today"]["time"]


def test_jobs_are_found_by_their_ids(client: feedplan.Client, part: Path) -> None:
    plan = client.plan(part, "mill", tolerance=0.037)
    assert client.job(plan.id)["state"] == "done"
    assert client.plan_of(plan.id).time == plan.time
    assert plan.id in {job["id"] for job in client.jobs("done")}
    client.delete(plan.id)
    with pytest.raises(feedplan.InputError, match="there is no such job: GET /v1/jobs lists those there are"):
        client.job(plan.id)
    assert client.machines() == feedplan.machines()
    assert client.methods() == feedplan.methods()
    assert client.health()["status"] == "ok"


def test_an_exception_while_waiting_cancels_the_job(client: feedplan.Client, server: Server) -> None:
    class EnoughError(Exception):
        pass

    def enough(stage: str, done: float) -> None:
        raise EnoughError

    with pytest.raises(EnoughError):
        client.plan(long_part(7), "mill", "jerk-limited", accuracy=1e-5, progress=enough)
    newest = client.jobs()[0]
    assert server.wait(newest["id"], seconds=10)["state"] == "cancelled"
    with pytest.raises(feedplan.FeedplanError, match="the job was cancelled while it ran: send it again"):
        client.plan_of(newest["id"])


def test_an_unreachable_service_is_one_sentence() -> None:
    with pytest.raises(feedplan.InputError, match=r"the service at http://127\.0\.0\.1:9 cannot be reached"):
        feedplan.Client("http://127.0.0.1:9").machines()
    for url in ("", "127.0.0.1:8000", "ftp://x", "http://", "http://x:y", 7):
        with pytest.raises(
            feedplan.InputError, match=r"the address of the service is .*: give one such as http:"
        ):
            feedplan.Client(url)  # type: ignore[arg-type]
    with pytest.raises(feedplan.InputError, match=r"the token is '\*\*\*': give"):
        feedplan.Client("http://x", "é")


def test_the_command_line_says_the_same(
    server: Server, part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def said(*options: str) -> list[str]:
        assert main(["plan", str(part), "--tolerance", "0.03", *options]) == 0
        return [line for line in capsys.readouterr().out.splitlines() if not line.startswith(OWN)]

    here, there = said("-o", str(tmp_path / "a")), said("--server", server.url, "-o", str(tmp_path / "b"))
    assert here == there
    for file in ("setpoints.npz",):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    assert main(["plan", str(part), "--machine", "auto", "--server", server.url]) == 0
    capsys.readouterr()
    assert main(["plan", str(part), "--server", server.url, "--program-out", str(tmp_path / "p.ngc")]) == 2
    assert "a service gives no program with planned feeds" in capsys.readouterr().err
    bad = tmp_path / "bad.ngc"
    bad.write_text("G1 Xq\n")
    codes = [main(["plan", str(bad), *options]) for options in ([], ["--server", server.url])]
    assert codes == [2, 2]
    first, second = capsys.readouterr().err.splitlines()
    assert first == second
