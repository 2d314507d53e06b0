"""Lines and arcs that are split where the planned speed varies: their ends, feeds and words."""

from __future__ import annotations

import re

import numpy as np
import pytest

import feedplan
from feedplan.program.program import MoveKind
from tests.planned_feeds.programs import again, planned

STEP = 50.0


def split(text: str, machine: str = "mill", step: float = STEP, **options: object) -> list[str]:
    """The lines of a program with planned feeds, split."""
    plan = planned(text, machine)
    result = feedplan.planned_program(plan, feed_step=step, **options)  # type: ignore[arg-type]
    return result.content.decode().splitlines()


def test_a_ramp_is_cut_where_the_speed_has_changed_by_a_step() -> None:
    # 60 mm from rest to rest at 3000 mm/s², up to 424.3 mm/s: v² is 6000 mm/s² × distance to the nearer end.
    text = "G21 G61\nG0 X0\nG1 X60 F60000 (there)\nG0 X0\nM2\n"
    plan = planned(text)
    result = feedplan.planned_program(plan, feed_step=STEP)
    program = again(result)
    lines = result.content.decode().splitlines()
    assert lines[2].startswith("G1 X")
    assert lines[2].endswith("(there)")
    own = program.kind == MoveKind.LINE
    ends, feeds = program.target[own, 0], program.feed[own]
    starts = np.concatenate([[0.0], ends[:-1]])
    top = np.where(starts < 30.0, np.where(ends > 30.0, 30.0, ends), 60.0 - starts)
    assert feeds == pytest.approx(np.sqrt(6000.0 * top), rel=2e-4)
    slowest = np.sqrt(6000.0 * np.minimum(np.minimum(starts, 60.0 - ends), 30.0))
    assert (feeds - slowest <= STEP * 1.001).all()
    assert 12 <= len(ends) <= 24
    assert ends[-1] == 60.0


def test_a_step_of_too_many_samples_is_refused() -> None:
    plan = planned("G21 G61\nG0 X0\nG1 X60 F60000\nM2\n")
    said = r"^feed_step is 1e-09 mm/s, and the speeds .* vary by .* mm/s in all: give one from 4e-05 mm/s$"
    with pytest.raises(feedplan.InputError, match=said):
        feedplan.planned_program(plan, feed_step=1e-9)


def test_without_a_step_nothing_is_split() -> None:
    plan = planned("G21 G61\nG0 X0\nG1 X60 F60000 (there)\nM2\n")
    assert feedplan.planned_program(plan).split == 0


@pytest.mark.parametrize("centre", ["I20", "R20", "I20 P2"])
@pytest.mark.parametrize(
    "plane", ["G17 {} X40 Y0", "G18 {} X40 Z0", "G17 {} X40 Y0 Z-3", "G91 G17 {} X40 Y0"]
)
def test_arcs_keep_their_centre_and_turn(plane: str, centre: str) -> None:
    arc = f"{plane.format('G3')} {centre}"
    text = f"G21 G61\nG0 X0\nG1 X-1 F30000\nX0\n{arc}\nG90 G0 X0\nM2\n"
    plan = planned(text)
    result = feedplan.planned_program(plan, feed_step=STEP)
    program, own = again(result), plan.program
    assert own is not None
    assert result.split >= 1
    assert len(program.arc_move) > 3
    normal = int(own.arc_normal[0])
    others = [axis for axis in range(3) if axis != normal]
    assert program.arc_centre[:, others] == pytest.approx(
        np.repeat(own.arc_centre[:, others], len(program.arc_move), axis=0), abs=1e-11
    )
    assert program.arc_angle.sum() == pytest.approx(own.arc_angle.sum(), abs=1e-11)
    assert (np.abs(program.arc_angle) <= np.pi + 1e-9).all()
    assert (program.arc_normal == normal).all()
    assert program.target[-1] == pytest.approx(own.target[-1], abs=1e-11)


def test_absolute_centres_and_inches_are_written_as_such() -> None:
    text = "G20 G61 G90.1\nG0 X0\nG1 X-.1 F3000\nX0\nG3 X2 Y0 I1 J0\nM2\n"
    lines = split(text)
    arcs = [line for line in lines[3:] if "I1" in line]
    assert len(arcs) > 3
    assert all(re.search(r"I1 J0", line) for line in arcs)


def test_increments_add_up_to_the_words_of_the_program() -> None:
    text = "G21 G61 G91\nG0 X0.1\nG1 X60.07 Y-0.3 F60000\nX0.1\nM2\n"
    lines = split(text)
    parts = [line for line in lines if "Y-0" in line]
    assert len(parts) > 3
    from decimal import Decimal

    total = [
        sum(Decimal(re.search(rf"{axis}([-\d.]+)", line)[1]) for line in parts)  # type: ignore[index]
        for axis in "XY"
    ]
    assert total == [Decimal("60.07"), Decimal("-0.3")]


def test_rotary_axes_go_along_with_the_parts() -> None:
    text = "G21 G61\nG0 X0 A0\nG1 X60 A30 F60000\nG1 A90 F99999\nM2\n"
    plan = planned(text, "rotary-table")
    result = feedplan.planned_program(plan, feed_step=10.0)
    program = again(result, "rotary-table")
    assert result.split == 2
    ends = program.target
    assert program.axes == ("X", "Y", "Z", "A")
    slanted = ends[: int((ends[:, 0] < 60.0).sum()) + 1]
    assert slanted[:, 3] == pytest.approx(slanted[:, 0] / 2.0, abs=1e-10)


def test_lines_with_words_that_are_said_once_stay_whole() -> None:
    text = (
        "G21 G61\nG0 X0\nG1 X60 F60000 M8\n#1=5 G1 X0\nG1 X[60]\nG53 G1 X0\nG41.1 D1 G1 X60\nG40 G1 X0\nM2\n"
    )
    lines = split(text)
    assert len(lines) == len(text.splitlines())


def test_exact_stops_are_not_multiplied() -> None:
    text = "G21 G61.1\nG0 X0\nG1 X60 F60000\nM2\n"
    assert len(split(text)) == 4


def test_the_other_feed_of_a_part_is_inverse_time() -> None:
    text = "G21 G61\nG0 X1\nG1 X61 F60000\nG3 X61 Y40 J20\nM2\n"
    plan = planned(text)
    result = feedplan.planned_program(plan, feed_step=STEP, inverse_time=True)
    plain = feedplan.planned_program(plan, feed_step=STEP)
    assert b"G93" in result.content
    moves, others = again(result), again(plain)
    assert moves.feed == pytest.approx(others.feed, rel=2e-4)


def test_the_time_with_parts_is_that_of_the_plan() -> None:
    text = "G21 G64 P0.02\nG0 X0\nG1 X60 F60000\nY40\nG3 X20 Y40 I-20\nG1 X0 Y0\nG1 X60 Y3\nM2\n"
    plan = planned(text)
    result = feedplan.planned_program(plan, feed_step=20.0)
    assert result.split >= 4
    assert feedplan.plan(again(result), "mill").time == pytest.approx(plan.time, rel=2e-3)
