"""How a plan's time and length are divided: by hand, and for every method."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest

from feedplan import Axis, Machine, Plan, plan, planners
from feedplan import Path as ToolPath
from feedplan.cli import main
from feedplan.program.gcode import read_gcode
from feedplan.report.account import account

MILL = Machine(
    "mill",
    (*(Axis(name, 300, 2000, 40_000) for name in "XYZ"), Axis("A", 180, 1000, 20_000)),
    chord_tolerance=0.01,
)


def planned(text: str, method: str = "bang-bang", machine: Machine = MILL, **options: Any) -> Plan:
    program = read_gcode(f"G21 G90\n{text}\nM2\n".encode(), machine, "part.ngc")
    return plan(program, machine, method, **options)


def parts(made: Plan) -> dict[str, float]:
    return {share.limit: share.part for share in made.account.limits}


def stops(made: Plan) -> dict[str, int]:
    return {row.cause: row.count for row in made.account.stops}


@pytest.mark.parametrize("method", sorted(set(planners.methods()) - {"toppra", "casadi", "clarabel"}))
def test_a_line_at_its_feed_has_the_feed_as_limit_by_every_method(method: str) -> None:
    shares = parts(planned("G1 X200 F600", method))
    assert shares["feed"] > 0.995
    assert math.fsum(shares.values()) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("method", sorted(set(planners.methods()) - {"toppra", "casadi", "clarabel"}))
def test_the_shares_of_all_limits_are_the_whole_time(method: str) -> None:
    made = planned("G64 P0.05\nG0 Z5\nG1 X20 F3000\nG3 X10 Y10 I-10\nG4 P0.25\nG1 X0 Y0", method)
    told = made.account
    assert math.fsum(share.part for share in told.limits) == pytest.approx(1.0, abs=1e-12)
    assert math.fsum(share.time for share in told.limits) == pytest.approx(made.time, rel=1e-9)
    assert parts(made)["dwell"] == pytest.approx(0.25 / made.time)
    assert told.feed.time + told.rapid.time + 0.25 == pytest.approx(made.time, rel=1e-9)


def test_each_phase_of_limited_jerk_has_its_limit() -> None:
    # 300 mm/s at 2000 mm/s² and 40 000 mm/s³: four times 0.05 s of jerk, twice 0.1 s at full acceleration.
    made = planned("G0 X150", "jerk-limited", accuracy=1e-5)
    assert made.time == pytest.approx(0.7, rel=1e-4)
    shares = parts(made)
    assert shares["X jerk"] == pytest.approx(0.2 / 0.7, abs=0.01)
    assert shares["X acceleration"] == pytest.approx(0.2 / 0.7, abs=0.01)
    assert shares["X velocity"] == pytest.approx(0.3 / 0.7, abs=0.01)


def test_millimetres_and_degrees_are_never_added() -> None:
    made = planned("G61\nG1 X10 F600\nG1 A90 F3600\nG1 X40 A130 F600\nG0 A0\nG0 X0")
    told = made.account
    assert (told.all.length, told.all.turn) == (pytest.approx(80.0), pytest.approx(220.0))
    assert (told.feed.length, told.feed.turn) == (pytest.approx(40.0), pytest.approx(90.0))
    assert (told.rapid.length, told.rapid.turn) == (pytest.approx(40.0), pytest.approx(130.0))
    # 90 deg at 60 deg/s and 1000 deg/s².
    assert told.feed.turn_time == pytest.approx(1.5 + 0.06)
    assert told.all.mean == pytest.approx(80.0 / (made.time - told.all.turn_time))
    assert made.summary()["length"] == pytest.approx(80.0)


def test_a_slow_line_that_only_turns_has_its_speed_in_degrees() -> None:
    made = planned("G61\nG1 A90 F3600\nG1 X10 F600")
    rows = {row.line: row for row in made.account.slow}
    assert (rows[3].turns, rows[4].turns) == (True, False)
    assert rows[3].speed == pytest.approx(90.0 / 1.56)
    assert rows[3].wanted == pytest.approx(60.0)


def test_uvw_count_where_x_y_z_stand_still() -> None:
    machine = Machine("wire", tuple(Axis(name, 300, 2000) for name in "XYUV"))
    path = ToolPath.from_points([[0, 0, 0, 0], [3, 4, 9, 9], [3, 4, 12, 13]], 0.0, axes="XYUV", feed=10.0)
    assert plan(path, machine).account.all.length == pytest.approx(5.0 + 5.0)


def test_the_tool_counts_on_machines_programmed_by_its_tip() -> None:
    machine = Machine.load("trunnion-ac")
    made = planned("G43.4 H1\nG0 X0 Y0 Z100\nG1 X30 F3000\nG1 A-30 C60 F3600\nG0 Z150", machine=machine)
    told = made.account
    # Corners are rounded within 0.01 mm.
    assert told.feed.length == pytest.approx(30.0, abs=0.02)
    assert told.feed.turn == pytest.approx(math.hypot(30.0, 60.0), abs=0.1)
    # All joints start at 0, so the tip is 120 mm below (the tool's length).
    assert told.rapid.length == pytest.approx(270.0, abs=0.02)


def test_stops_are_counted_by_cause() -> None:
    made = planned(
        "G64 P0.05\nG1 X10 F600\nM0\nG1 X20\nG4 P0.5\nG1 X30\nM5\nM6 T2\nM3 S100\nG1 X40\nM8\nG1 X50\n"
        "G0 Y10\nG1 X40\nG61.1\nG1 X30\nG1 X20\nG61\nG1 X10\nG1 Y0\nG1 Y5\nG1 X20",
        "jerk-limited",
    )
    assert stops(made) == {
        "programmed stop (M0, M1, M60)": 1,
        "dwell (G4)": 1,
        "tool change (M6)": 1,
        "spindle, coolant and the like": 1,
        "exact stop (G61.1)": 2,
        "corner on the exact path (G61, cycles)": 2,
        "turning back": 1,
        "change between G64 and the exact path (G61, G61.1, cycles)": 1,
        "start and end": 2,
    }
    by_cause = {row.cause: row for row in made.account.stops}
    assert by_cause["dwell (G4)"].pause == 0.5
    # From 10 mm/s to rest takes 2 √(10/40 000) s at 40 000 mm/s³, and as long back: half of both is lost.
    assert by_cause["programmed stop (M0, M1, M60)"].lost == pytest.approx(
        2.0 * math.sqrt(10 / 4e4), rel=0.05
    )


def test_stops_of_paths_without_a_program_are_corners() -> None:
    path = ToolPath.from_points([[0, 0, 0], [10, 0, 0], [10, 10, 0], [10, 0, 0]], 0.0, feed=10.0)
    made = plan(path, MILL)
    assert stops(made) == {"start and end": 2, "corner that cannot be rounded": 1, "turning back": 1}


def test_stops_lose_no_more_than_the_whole_plan() -> None:
    for method in ("bang-bang", "jerk-limited", "s-curve"):
        made = planned("G64 P0.02\nF6000\nG1 X3 Y2\nG1 X9 Y-1\nM0\nG1 X9.5\nG0 X0\nG1 Y3", method)
        lost = sum(row.lost for row in made.account.stops)
        assert 0.0 < lost <= made.profile.time


def test_the_given_tolerance_is_shown() -> None:
    assert planned("G64 P0.05\nG1 X10 F600\nG1 X20 Y5").account.tolerance == (0.05, 0.05)
    assert planned("G1 X10 F600\nG1 X20 Y5", tolerance=0.02).account.tolerance == (0.02, 0.02)
    assert planned("G61\nG1 X10 F600\nG64 P0.05\nG1 X20 Y5\nG1 X30").account.tolerance == (0.001, 0.05)


def test_the_page_the_table_and_plan_json_say_the_same(tmp_path: Path, capsys: Any) -> None:
    program = tmp_path / "part.ngc"
    program.write_text("G21 G90 G61\nG0 X10\nG1 X60 F600\nG1 A90 F3600\nM2\n")
    out = tmp_path / "out"
    arguments = ["plan", str(program), "-m", "rotary-table", "-o", str(out), "--format", "none"]
    assert main(arguments) == 0
    rows = dict(line.split(None, 1) for line in capsys.readouterr().out.splitlines())
    assert "for this path" in rows["lower"]
    assert rows["length"].startswith("60.000 mm")
    assert rows["rapid"].endswith(", 10 mm")
    assert rows["limits"].startswith("feed ")
    assert "1 × corner on the exact path (G61, cycles)" in rows["stops"]
    assert rows["tolerance"] == "0.001 mm"
    assert sorted(file.name for file in out.iterdir()) == ["plan.json", "report.html"]
    summary = json.loads((out / "plan.json").read_text())
    assert summary["totals"]["rapid"]["length"] == pytest.approx(10.0)
    assert summary["turn"] == pytest.approx(90.0)
    assert summary["tolerance"] == {"least": 0.001, "greatest": 0.001}
    assert {row["cause"] for row in summary["stops_by_cause"]} >= {"start and end"}
    assert math.fsum(share["part"] for share in summary["limits"].values()) == pytest.approx(1.0)
    page = (out / "report.html").read_text(encoding="utf-8")
    for words in (
        "no plan of this path is faster",
        "turns alone 90 deg",
        "at a feed, turning alone",
        "0.001 mm",
    ):
        assert words in page


def test_more_arcs_than_moments_have_the_same_shares(monkeypatch: pytest.MonkeyPatch) -> None:
    made = planned("G64 P0.02\nF6000\nG1 X30 Y2\nG1 X90 Y-10\nG0 X0\nG1 Y3", "jerk-limited")
    exact = parts(made)
    # With fewer moments than phases, the moments are spread evenly over the whole time.
    monkeypatch.setattr("feedplan.report.activity._MOMENTS", len(made.profile) - 1)
    even = account(made.problem, made.profile, made.program, True)
    assert math.fsum(share.part for share in even.limits) == pytest.approx(1.0)
    found = {share.limit: share.part for share in even.limits}
    # A few moments may miss a limit that only few phases use.
    both = exact.keys() | found.keys()
    assert {limit: found.get(limit, 0.0) for limit in both} == pytest.approx(
        {limit: exact.get(limit, 0.0) for limit in both}, abs=0.02
    )
