"""LinuxCNC's interpreter makes the same moves of a program with planned feeds as of the original."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

import feedplan
from feedplan.errors import FeedplanError
from tests.campaign import seeds
from tests.planned_feeds.programs import SQUARE, Writer, planned
from tests.program.linuxcnc import difference, moves_of, needs_linuxcnc, reference

pytestmark = needs_linuxcnc

# Options of `planned_program`; with the last two it writes other blocks for the same moves.
WAYS = ({}, {"inverse_time": True}, {"feed_step": 15.0}, {"expand": True})


# Two NURBS after straight moves, because LinuxCNC's preview gives them the height of the last straight move.
NURBS = """G21 G17
G0 X0 Y0 Z2
G1 Z0 F600
G1 X1 F40000
G5.2 X3 Y4 P1 L3
X8 Y5 P2
X12 Y1 P1
X15 Y3 P0.7
G5.3
G1 X20
G5 X30 Y0 I4 J4 P-4 Q4
G1 X40
M2
"""


class WithoutSplines(Writer):
    """Programs without splines, whose moves LinuxCNC's preview shows exactly."""

    def spline(self) -> None:
        self.line()


@pytest.fixture
def tools(tmp_path: Path) -> Path:
    file = tmp_path / "tools.tbl"
    file.write_text("T1 P1 Z50.25 D6\n")
    return file


def test_the_moves_are_the_programs(tools: Path, tmp_path: Path) -> None:
    own: list[Path] = []
    written: list[tuple[int, Path, feedplan.Program, bool]] = []
    for seed in range(seeds(12)):
        by_hand = (SQUARE, NURBS)
        text = by_hand[seed] if seed < len(by_hand) else WithoutSplines(random.Random(seed)).text()
        plan = planned(text)
        own.append(tmp_path / f"{seed}.ngc")
        own[-1].write_bytes(text.encode())
        for way, options in enumerate(WAYS):
            try:
                result = feedplan.planned_program(plan, **options)  # type: ignore[arg-type]
            except FeedplanError:
                continue
            file = tmp_path / f"{seed}_{way}.ngc"
            result.write(file)
            written.append((seed, file, feedplan.read_program(file, "mill"), way < 2))
    before = reference(own, tools)
    wrong, compared = [], 0
    for (seed, file, program, same), (moves, error) in zip(
        written, reference([file for _, file, _, _ in written], tools), strict=True
    ):
        theirs, refused = before[seed]
        if refused is not None:
            continue
        if error is not None:
            wrong.append(f"{file.name}: LinuxCNC says {error}")
            continue
        compared += 1
        found = difference(moves_of(program), moves)
        if found is None and same:
            found = difference(theirs, moves, 0.0)
        if found is not None:
            wrong.append(f"{file.name}: {found}")
    assert not wrong, "\n".join(wrong)
    assert compared >= 20
