"""Canned cycles written out as moves; the first cases are those of the LinuxCNC manual."""

import math

import pytest

from feedplan.errors import ProgramError
from feedplan.program.gcode import read_gcode
from feedplan.program.program import PathControl, Program

Row = tuple[float, float, float, bool]


def read(text: str) -> Program:
    return read_gcode(f"G21 F600\n{text}\nM2\n".encode())


def rows(text: str, skip: int = 1) -> list[Row]:
    """Targets and whether they are reached at a feed, without the first `skip` moves."""
    program = read(text)
    reached = [math.isfinite(feed) for feed in program.feed]
    return [(*target, feed) for target, feed in zip(program.target.tolist(), reached, strict=True)][skip:]


def test_g81_drills_once_in_absolute_mode() -> None:
    assert rows("G0 X1 Y2 Z3\nG90 G98 G81 X4 Y5 Z1.5 R2.8") == [
        (4, 5, 3, False),
        (4, 5, 2.8, False),
        (4, 5, 1.5, True),
        (4, 5, 3, False),
    ]


def test_g81_drills_three_times_in_incremental_mode() -> None:
    found = rows("G0 X1 Y2 Z3\nG91 G98 G81 X4 Y5 Z-0.6 R1.8 L3")
    expected: list[Row] = [(1, 2, 4.8, False)]
    for i in (1, 2, 3):
        x, y = 1 + 4 * i, 2 + 5 * i
        expected += [(x, y, 4.8, False), (x, y, 4.2, True), (x, y, 4.8, False)]
    assert [row[3] for row in found] == [row[3] for row in expected]
    for one, other in zip(found, expected, strict=True):
        assert one == pytest.approx(other, abs=1e-14)


def test_words_of_a_cycle_are_kept_until_they_change() -> None:
    found = rows("G0 Z10\nG99 G82 X0 Z-1 R2 P0.5\nX1\nX2 Z-2\nG98 X3")
    assert [row[2] for row in found if row[3]] == [-1, -1, -2, -2]
    assert found[-1] == (3, 0, 10, False)
    assert found[-3:-1] == [(3, 0, 2, False), (3, 0, -2, True)]
    program = read("G0 Z10\nG99 G82 X0 Z-1 R2 P0.5\nX1\nG80\nG0 Z10")
    assert sorted(program.dwell.tolist())[-2:] == [0.5, 0.5]


def test_g73_breaks_chips_and_g83_clears_them() -> None:
    def depths(code: str) -> list[tuple[float, bool]]:
        return [(row[2], row[3]) for row in rows(f"G0 Z5\nG99 {code} Z-5 R1 Q2.5 X0", skip=2)]

    down, up = True, False
    assert depths("G73") == [
        (-1.5, down), (-1.246, up), (-4, down), (-3.746, up), (-5, down), (1, up),
    ]  # fmt: skip
    assert depths("G83") == [
        (-1.5, down), (1, up), (-1.246, up), (-4, down), (1, up), (-3.746, up), (-5, down), (1, up),
    ]  # fmt: skip
    assert depths("G83 D0.5")[2] == (-1, up)


def test_boring_and_tapping_cycles_differ_in_their_way_up() -> None:
    def way_up(code: str) -> list[tuple[float, bool, float]]:
        program = read(f"G98 G0 Z5\n{code} X0 Z-5 R1")
        assert program.target[2].tolist() == [0, 0, -5]
        feeds = [math.isfinite(feed) for feed in program.feed]
        return list(zip(program.target[2:, 2].tolist(), feeds[2:], program.dwell[2:].tolist(), strict=True))

    assert way_up("G81") == [(-5, True, 0), (5, False, 0)]
    assert way_up("G82 P2") == [(-5, True, 2), (5, False, 0)]
    assert way_up("G85") == [(-5, True, 0), (1, True, 0), (5, False, 0)]
    assert way_up("G86 P2") == [(-5, True, 2), (5, False, 0)]
    assert way_up("G89 P2") == [(-5, True, 2), (5, True, 0)]
    assert way_up("G84") == [(-5, True, 0), (5, True, 0)]
    assert way_up("G74 P1") == [(-5, True, 1), (5, True, 0)]


def test_cycles_that_turn_the_spindle_back_or_stop_it_tell_so() -> None:
    def told(start: str, cycle: str) -> list[tuple[int, str]]:
        events = read(f"S500 {start}\nG98 G0 Z5\n{cycle}").events
        return list(zip(events.move.tolist(), events.words(), strict=True))[2:-1]

    # The moves: to Z5, down to R, to the bottom, up again.
    assert told("M3", "G84 X0 Z-5 R1") == [(3, "G4 P0"), (3, "M4"), (4, "M3")]
    assert told("M4", "G74 X0 Z-5 R1") == [(3, "G4 P0"), (3, "M3"), (4, "M4")]
    assert told("M4", "G86 X0 Z-5 R1 P2") == [(3, "G4 P2"), (3, "M5"), (4, "M4")]
    assert told("M3", "G33.1 Z-5 K1") == [(2, "M4"), (3, "M3")]
    # A spindle at rest is not started.
    assert told("M5", "G84 X0 Z-5 R1") == [(3, "G4 P0")]


def test_cycles_follow_plane_units_and_offsets() -> None:
    program = read("G20 G19 G10 L2 P1 X1 Y2\nG0 X1\nG99 G81 X-1 Y1 R0.5")
    assert program.target[-2].tolist() == pytest.approx([0, 3 * 25.4, 0])
    assert program.target[-1].tolist() == pytest.approx([1.5 * 25.4, 3 * 25.4, 0])


def test_the_path_is_exact_within_cycles() -> None:
    program = read("G64 P0.1\nG0 Z5\nG81 X1 Z-1 R1\nG0 X5")
    exact, blend = PathControl.EXACT_PATH, PathControl.TOLERANCE
    assert program.control.tolist() == [blend, exact, exact, exact, exact, blend]
    assert program.blend_tolerance[-1] == 0.1
    program = read("G61.1\nG0 Z5\nG81 X1 Z-1 R1")
    assert set(program.control.tolist()) == {PathControl.EXACT_STOP}


def test_the_height_before_a_series_is_forgotten_after_it() -> None:
    text = "G98 G0 Z20\nG81 X1 Z-1 R2\nX2\nG80\nG0 Z5\nG81 X3 Z-1 R2"
    assert rows(text)[-1] == (3, 0, 5, False)


def test_without_g98_and_g99_cycles_go_back_to_r_with_a_warning() -> None:
    program = read("G0 Z5\nG81 X1 Z-1 R2\nX2")
    assert program.target[-1].tolist() == [2, 0, 2]
    assert program.warnings[0].startswith("line 3: neither G98 nor G99 is given: cycles go back to R (G99)")
    assert not any("G98" in warning for warning in read("G99 G0 Z5\nG81 X1 Z-1 R2\nX2").warnings)


def test_a_dwell_that_a_cycle_has_not_is_left_out_with_a_warning() -> None:
    program = read("G0 Z1\nG83 X1 Z-1 R1 Q1 P500\nX2 P500")
    assert not program.dwell.any()
    assert sum("the dwell P500 of G83 is left out" in warning for warning in program.warnings) == 1


def test_a_cycle_from_below_r_rises_before_it_crosses() -> None:
    assert rows("G0 Z1\nG81 X5 Z-1 R3") == [
        (0, 0, 3, False),
        (5, 0, 3, False),
        (5, 0, -1, True),
        (5, 0, 3, False),
    ]


def test_g80_gives_way_to_another_motion_in_its_block() -> None:
    assert rows("G0 Z5\nG98 G81 X1 Z-1 R1\nG80 G0 X9", skip=-1) == [(9, 0, 5, False)]
    assert rows("G0 Z5\nG0 G17 G40 G49 G80 G90 X9") == [(9, 0, 5, False)]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("G81 X1 Z-1", "G81 has no R"),
        ("G81 X1 R1", "G81 has no Z"),
        ("G19 G81 X1 Y1", "G81 has no R"),
        ("G82 X1 Z-1 R1", "G82 has no dwell"),
        ("G89 X1 Z-1 R1 P-1", "word P-1"),
        ("G83 X1 Z-1 R1", "no depth of one peck"),
        ("G73 X1 Z-1 R1 Q0", "no depth of one peck"),
        ("G83 X1 Z-1 R1 Q-2", "no depth of one peck"),
        ("G83 X1 Z-1000 R1 Q0.0001", "10010000 pecks"),
        ("G81 X1 Z5 R1", "above its retract height"),
        ("G81 X1 Z-1 R1 L0", "word L0"),
        ("G81 X1 Z-1 R1 L1.5", "word L1.5"),
        ("G81 X1 Z-1 R1 L2000000", "word L2000000"),
        ("G81 X1 Z-1 R1 K3", "word K3 has no meaning here: repetitions are counted by L"),
        ("G81 X1 Z-1 R1 A2", "word A2"),
        ("G81 X1 Z-1 R1 U2", "word U2"),
        ("G81 R1", "G81 has no axis words"),
        ("G93 G81 X1 Z-1 R1", "inverse time"),
        ("G81 X1 Z-1 R1E9", "word E9"),
        ("G81 X1 Z-1 R2000000", "Z would go to 2000000 mm"),
        ("G91 G81 X100000 Z-1 R1 L20", "X would go to 1100000 mm"),
        ("G80\nX1", "word X1 has no motion code in force"),
        ("G80 X1", "beside G80"),
    ],
)
def test_a_cycle_that_cannot_be_followed_says_why(text: str, words: str) -> None:
    with pytest.raises(ProgramError) as caught:
        read(text)
    assert words in str(caught.value)


def test_generated_moves_are_bounded() -> None:
    text = b"G21 F60\nG81 X1 Z-1 R1 L1000\nM2\n"
    assert len(read_gcode(text, max_moves=4000)) == 2002
    with pytest.raises(ProgramError, match="line 2: the program has more than 1000 moves: split it"):
        read_gcode(text, max_moves=1000)
