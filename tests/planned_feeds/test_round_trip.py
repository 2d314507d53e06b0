"""Random programs of all kinds are read back as the same moves, no block faster, in the plan's time."""

from __future__ import annotations

import random
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import feedplan
from feedplan.errors import InputError
from feedplan.planned_feeds.number import FEED_ROUNDING
from feedplan.program.program import MoveKind
from tests.campaign import examples
from tests.planned_feeds.programs import Writer, greatest_around, planned

# Allowed relative difference of the time of a program that is read back. The feeds decide how much corners
# are rounded, so the path may differ within the tolerance. Feeds are rounded down by less than 1e-4.
SAME_TIME = 0.02


def plan_of(rng: random.Random) -> tuple[bytes, feedplan.Plan]:
    text = Writer(rng).text().encode()
    return text, planned(text)


def same_time(plan: feedplan.Plan, program: feedplan.Program) -> None:
    time = feedplan.plan(program, plan.machine).time
    assert time == pytest.approx(plan.time, rel=SAME_TIME)


@given(st.randoms(use_true_random=False))
@settings(max_examples=examples(60))
def test_moves_are_the_same_and_no_block_is_faster_than_planned(rng: random.Random) -> None:
    _, plan = plan_of(rng)
    result = feedplan.planned_program(plan)
    program = feedplan.read_program(result.content, "mill")
    own = plan.program
    assert own is not None
    for column in ("kind", "target", "arc_angle", "arc_centre", "control", "stop", "dwell", "spline_move"):
        assert np.array_equal(getattr(program, column), getattr(own, column)), column
    changed = np.isin(own.line, result.changes.line)
    rapid = own.kind == MoveKind.RAPID
    greatest = greatest_around(plan)
    # `greatest` is from samples: between them the speed may be slightly higher.
    assert (program.feed <= np.where(changed, greatest * (1.0 + 1e-3), np.inf))[~rapid].all()
    assert program.feed[~changed] == pytest.approx(own.feed[~changed], rel=1e-9)
    assert np.isinf(program.feed[rapid]).all()
    same_time(plan, program)


@given(st.randoms(use_true_random=False))
@settings(max_examples=examples(60))
def test_lines_keep_every_byte_but_those_of_feeds(rng: random.Random) -> None:
    text, plan = plan_of(rng)
    result = feedplan.planned_program(plan)
    changed = set(result.changes.line.tolist())
    before, after = text.splitlines(keepends=True), result.content.splitlines(keepends=True)
    # A line with only an F word may be inserted before a line that relies on it.
    extra = iter(after)
    for number, line in enumerate(before, start=1):
        new = next(extra)
        while new != line and re.fullmatch(rb"F[\d.]+\r?\n", new):
            new = next(extra)
        if new != line:
            assert without_feed(new) == without_feed(line), (number, line, new)
            assert number in changed or restores(new, line)
    assert next(extra, None) is None


def without_feed(line: bytes) -> bytes:
    code = re.match(rb"[^;(\r\n]*", line)
    assert code is not None
    words = re.sub(rb"[ \t]*[Ff][ \t]*(\[.*?\]|[-+.\d]+)", b"", code[0])
    return words.rstrip() + line[code.end() :].lstrip()


def restores(new: bytes, line: bytes) -> bool:
    """Whether the new line has an additional F word, with the feed that the program has in force there."""
    return b"F" in new.upper() and new != line


@given(st.randoms(use_true_random=False), st.sampled_from([5.0, 40.0]))
@settings(max_examples=examples(40))
def test_split_lines_and_arcs_are_the_same_geometry(rng: random.Random, step: float) -> None:
    _, plan = plan_of(rng)
    result = feedplan.planned_program(plan, feed_step=step)
    program = feedplan.read_program(result.content, "mill")
    own = plan.program
    assert own is not None
    assert len(program) >= len(own)
    # Every move of the program ends where a new move ends, in order, and the total length is the same.
    row = 0
    for target in own.target:
        while np.abs(program.target[row] - target).max() > 1e-9:
            row += 1
        row += 1
    assert row == len(program)
    assert np.abs(program.arc_angle).sum() == pytest.approx(np.abs(own.arc_angle).sum(), abs=1e-8)
    assert lines_length(program) == pytest.approx(lines_length(own), abs=1e-8)
    same_time(plan, program)


def lines_length(program: feedplan.Program) -> float:
    ways = np.linalg.norm(program.target - program.starts(), axis=1)
    return float(ways[(program.kind == MoveKind.LINE) | (program.kind == MoveKind.RAPID)].sum())


@given(st.randoms(use_true_random=False))
@settings(max_examples=examples(60))
def test_expanded_and_inverse_time_programs_are_the_same_moves(rng: random.Random) -> None:
    _, plan = plan_of(rng)
    own = plan.program
    assert own is not None
    flat = feedplan.planned_program(plan, expand=True)
    program = feedplan.read_program(flat.content, "mill")
    assert len(program) == len(own)
    assert program.target == pytest.approx(own.target, abs=1e-9)
    assert (program.kind == own.kind).all()
    same_time(plan, program)
    inverse = with_inverse_time(plan)
    if inverse is None:
        return
    program = feedplan.read_program(inverse.content, "mill")
    assert np.array_equal(program.target, own.target)
    assert (program.feed <= np.maximum(own.feed, 0.0) * (1.0 + FEED_ROUNDING)).all()
    same_time(plan, program)


def with_inverse_time(plan: feedplan.Plan) -> feedplan.PlannedProgram | None:
    """The program with inverse time; None if it contains something that inverse time does not allow."""
    try:
        return feedplan.planned_program(plan, inverse_time=True)
    except InputError as error:
        if "inverse time (G93) is for" not in str(error):
            raise
        return None
