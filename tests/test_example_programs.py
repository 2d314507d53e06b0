"""The programs in examples/ can be planned unchanged, and `feedplan time` lists their operations."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path as FilePath
from typing import Any

import pytest

import feedplan
from benchmarks.named import EXAMPLES
from feedplan.cli import main
from feedplan.program.gcode import read_gcode
from feedplan.program.machine_for import smallest_machine
from feedplan.program.read import read_program
from feedplan.program.tools import read_tools
from tests.program.linuxcnc import difference, moves_of, needs_linuxcnc, reference

# For each file: its machine, its tools and its operations.
PROGRAMS: dict[str, tuple[str, list[int | None], list[str]]] = {
    "part.ngc": ("mill", [1, 2, 3], ["FACE", "FOUR HOLES"]),
    "bracket.nc": (
        "mill",
        [1, 2, 3, 4],
        ["POCKET", "OUTSIDE", "SPOT DRILLING", "DRILLING", "TAPPING M8 X 1.25"],
    ),
    "die.ngc": ("highspeed", [5], ["FINISH, PARALLEL"]),
    "bar.ngc": ("rotary-table", [7], ["WAVE", "RINGS", "FLATS"]),
    "gear.gcode": ("router", [None], ["Engraving", "Holes", "Gear"]),
}


def test_every_program_is_here() -> None:
    found = {file.name for file in EXAMPLES.iterdir() if file.suffix in (".ngc", ".nc", ".gcode")}
    assert found == set(PROGRAMS)


@pytest.mark.parametrize(
    ("name", "method"), [*((name, "bang-bang") for name in PROGRAMS), ("bar.ngc", "jerk-limited")]
)
def test_a_program_is_planned_within_all_limits(name: str, method: Any) -> None:
    options = {"time_limit": 0.0} if method == "jerk-limited" else {}
    plan = feedplan.plan(EXAMPLES / name, PROGRAMS[name][0], method, **options)
    assert plan.audit().ok
    assert 10.0 < plan.time < 600.0


def test_each_program_finds_its_smallest_machine() -> None:
    found = {
        name: smallest_machine(lambda machine, name=name: read_program(EXAMPLES / name, machine))[0].name  # type: ignore[misc]
        for name in PROGRAMS
    }
    assert found == {name: "rotary-table" if name == "bar.ngc" else "mill" for name in PROGRAMS}


@needs_linuxcnc
def test_linuxcnc_reads_the_same_moves(tmp_path: FilePath) -> None:
    tools = tmp_path / "tool.tbl"
    tools.write_text("".join(f"T{number} P{number} Z{10 * number} D6\n" for number in range(1, 8)))
    files = [EXAMPLES / name for name in PROGRAMS]
    for file, (moves, error) in zip(files, reference(files, tools), strict=True):
        assert error is None, (file, error)
        assert difference(moves_of(read_gcode(file, tools=read_tools(tools))), moves) is None


@pytest.mark.parametrize("name", PROGRAMS)
def test_time_per_tool_and_operation(name: str, capsys: Any) -> None:
    machine, tools, operations = PROGRAMS[name]
    assert main(["time", str(EXAMPLES / name), "--machine", machine, "--tool-change", "4", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [row["tool"] for row in told["tools"]] == tools
    assert set(operations) <= {row["name"] for row in told["operations"]}
    changes = 4.0 * sum(tool is not None for tool in tools)
    plan = feedplan.plan(EXAMPLES / name, machine)
    assert told["time"] == pytest.approx(plan.time + changes)
    assert sum(row["time"] for row in told["operations"]) == pytest.approx(told["time"])


def test_time_prints_a_table_and_takes_standard_input(capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.TextIOWrapper(io.BytesIO((EXAMPLES / "part.ngc").read_bytes()))
    monkeypatch.setattr(sys, "stdin", stream)
    assert main(["time", "-"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["operation", "line", "feed", "rapid", "dwell", "time", "part"]
    assert [line.split()[0] for line in lines if not line.startswith(" ")] == [
        "operation",
        "T1",
        "T2",
        "T3",
        "whole",
    ]
    assert any(line.startswith("  FOUR HOLES") for line in lines)


def test_time_shows_the_time_of_today(capsys: Any) -> None:
    command = ["time", str(EXAMPLES / "part.ngc"), "--controller", "grbl"]
    assert main([*command, "--json"]) == 0
    today = json.loads(capsys.readouterr().out)["today"]
    plan = feedplan.plan(EXAMPLES / "part.ngc", "mill", controller="grbl")
    assert plan.today is not None
    assert (today["controller"], today["time"]) == ("grbl", pytest.approx(plan.today.time))
    assert main(command) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("today: ")


def test_time_reports_a_broken_limit(capsys: Any) -> None:
    assert main(["time", str(EXAMPLES / "part.ngc"), "--method", "junction-deviation"]) == 1
    out, error = capsys.readouterr()
    assert out.splitlines()[-1].startswith("whole program")
    assert "error: the audit failed: " in error
