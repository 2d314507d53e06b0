"""`feedplan.check` of events in files and of tables of knots."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from feedplan import Machine, plan
from feedplan.checking import check
from feedplan.cli import main
from feedplan.errors import InputError
from feedplan.plan_folder import write_plan
from tests.sentences import assert_one_sentence

WITH_EVENTS = "G21 G90 G61\nF3000\nS900 M3\nG1 X20\nG4 P0.05\nM8\nG1 Y10\nM62 P1\nG1 Y20\nM5\nM2\n"


def change_event(number: int, **entries: Any) -> Callable[[list[dict[str, Any]]], object]:
    return lambda events: events[number].update(entries)


def later(events: list[dict[str, Any]]) -> None:
    """Moves the coolant event behind the dwell, to a time at which the tool moves."""
    events[3]["time"] += 0.1


EVENT_CHANGES = [
    (lambda events: events.pop(2), None),
    (lambda events: events.reverse(), "and the one before it is at"),
    (change_event(0, value=950.0), None),
    (change_event(4, text="M62 P2"), None),
    (change_event(0, kind="laser"), "is of the kind 'laser', and kinds are spindle, coolant"),
    (change_event(-1, time=1e3), "is at 1000 s, and setpoints go from 0 to"),
    (change_event(0, time=-1.0), "is at -1 s, and setpoints go from 0 to"),
    (change_event(2, value=0.5), "takes 0.5 s, and the tool moves before"),
    (later, "the event M8 of line 6 stops the tool, and it moves at"),
]


@pytest.mark.parametrize("name", ["json", "csv", "pvt", "halstreamer"])
@pytest.mark.parametrize(("change", "why"), EVENT_CHANGES)
def test_changed_events_are_refused(
    name: str, change: Callable[[Any], object], why: str | None, tmp_path: Path, capsys: Any
) -> None:
    made = plan(WITH_EVENTS, Machine.load("mill"))
    [*_, file] = sorted(write_plan(made, tmp_path, [name], step=0.01 if name == "pvt" else None))
    assert check(tmp_path).ok
    if name == "json":
        table = json.loads(file.read_text())
        change(table["events"])
        file.write_text(json.dumps(table))
    else:
        lines = file.read_text().splitlines()
        events = [json.loads(line[8:]) for line in lines if line.startswith("# event")]
        change(events)
        rest = [line for line in lines if not line.startswith("# event")]
        file.write_text("\n".join([*rest, *(f"# event {json.dumps(event)}" for event in events)]) + "\n")
    assert main(["check", str(file)]) == 2
    assert_one_sentence(capsys.readouterr().err, "its events are not those that")
    (tmp_path / "plan.json").unlink()
    machine = ["-m", "mill"]
    # From positions alone a single setpoint does not show that the tool moves.
    if why is None or (change is later and name == "halstreamer"):
        assert main(["check", str(file), *machine]) == 0
    else:
        assert main(["check", str(file), *machine]) == 2
        assert_one_sentence(capsys.readouterr().err, why)


def test_knots_of_another_plan_are_refused(tmp_path: Path) -> None:
    made = plan(WITH_EVENTS, Machine.load("mill"))
    write_plan(made, tmp_path / "a", ["pvt"], step=0.01)
    write_plan(made, tmp_path / "b", ["pvt"], step=0.02)
    write_plan(made, tmp_path / "c", ["npz"])
    table = tmp_path / "a" / "setpoints.pvt"
    for other, sentence in (("b", "the number of knots is"), ("c", "the table is one of knots")):
        shutil.copy(table, tmp_path / other / "setpoints.pvt")
        with pytest.raises(InputError, match=sentence):
            check(tmp_path / other / "setpoints.pvt")
    # The audit fails if a knot is so far away that no axis can reach it.
    lines = table.read_text().splitlines()
    knots = [number for number, line in enumerate(lines) if line[0] not in "#t"]
    fields = lines[knots[5]].split(",")
    fields[2] = str(float(fields[2]) + 0.5)
    lines[knots[5]] = ",".join(fields)
    table.write_text("\n".join(lines) + "\n")
    audit = check(table)
    assert {broken.axis for broken in audit.broken} == {"X"}


def test_a_pvt_table_needs_a_step_and_no_other_format_has_one(tmp_path: Path, capsys: Any) -> None:
    made = plan(WITH_EVENTS, Machine.load("mill"))
    with pytest.raises(InputError, match=r"pvt has no step: give its longest one \[s\], --step"):
        write_plan(made, tmp_path / "a", ["pvt"])
    with pytest.raises(InputError, match=r"the step is 0.1: give it with the format pvt alone"):
        write_plan(made, tmp_path / "a", ["npz"], step=0.1)
    with pytest.raises(InputError, match=r"the step is 0 s: give a positive number"):
        write_plan(made, tmp_path / "a", ["pvt"], step=0.0)
    assert not (tmp_path / "a").exists()
    program = tmp_path / "a.ngc"
    program.write_text(WITH_EVENTS)
    out = ["-o", str(tmp_path / "b"), "--format", "pvt", "--step", "0.01"]
    assert main(["plan", str(program), *out]) == 0
    assert main(["check", str(tmp_path / "b")]) == 0
    assert "cubic acceleration" in capsys.readouterr().out
