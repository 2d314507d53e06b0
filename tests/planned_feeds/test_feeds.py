"""The F word of each line: where it is written, where the program's own F is restored, and what stays."""

from __future__ import annotations

import numpy as np
import pytest

import feedplan
from feedplan.errors import InputError
from feedplan.planned_feeds.blocks import Exclusion, blocks_of
from feedplan.planned_feeds.number import feed_texts, rounded_down
from feedplan.program.program import MoveKind
from tests.planned_feeds.programs import SQUARE, again, planned


def rewritten(text: str, machine: str = "mill", **options: object) -> str:
    """The text with planned feeds."""
    result = feedplan.planned_program(planned(text, machine), **options)  # type: ignore[arg-type]
    return result.content.decode()


def feeds_of(text: str, machine: str = "mill") -> dict[int, float]:
    """The feed [mm/s] of each line of a program."""
    program = feedplan.read_program(text.encode(), machine)
    return dict(zip(program.line.tolist(), program.feed.tolist(), strict=True))


def test_the_peak_of_a_triangle_by_hand() -> None:
    # 30 mm from rest to rest at 3000 mm/s² peak at √(3000 · 30) = 300 mm/s: F18000.
    text = SQUARE.replace("G21 G90 G17", "G21 G90 G17 G61.1")
    result = feedplan.planned_program(planned(text))
    lines = result.content.decode().splitlines()
    assert lines[5:10] == [
        "N20 X30 F18000  (along)",
        "N30 Y30",
        "",
        "N40 X0",
        "N50 Y0",
    ]
    assert result.changes.line.tolist() == [6, 7, 9, 10]
    assert set(result.changes.before) == {60000.0}
    assert set(result.changes.after) == {18000.0}


def test_a_program_whose_feeds_are_reached_comes_back_byte_for_byte() -> None:
    text = SQUARE.replace("F60000", "F600").replace("\n", "\r\n") + "; the end"
    result = feedplan.planned_program(planned(text))
    assert result.content == text.encode()
    assert result.changed == 0


def test_a_feed_that_is_reached_again_comes_back() -> None:
    # The second side is long enough to reach F12000, 200 mm/s: speeding up takes 6.7 mm.
    text = "G21 G61.1\nG0 X0\nG1 X5 F12000\nX100\nX105\nM2\n"
    assert rewritten(text) == "G21 G61.1\nG0 X0\nG1 X5 F7348.4\nX100 F12000\nX105 F7348.4\nM2\n"


def test_words_are_written_in_the_style_of_the_line() -> None:
    text = "g21 g61.1\ng1x5f60000\ny5(note; no end)\n\tz5\t; f3\nx0 ; (\nm2\n"
    assert rewritten(text) == (
        "g21 g61.1\ng1x5f7348.4\ny5(note; no end)\n\tz5 f6708.2\t; f3\nx0 f7348.4 ; (\nm2\n"
    )


def test_inches_and_rotary_words_count_in_their_units() -> None:
    text = "G20 G61.1\nG1 X1 F9999\nM2\n"
    # 25.4 mm from rest to rest: 276.04 mm/s are 652.07 inch/min.
    assert "F652.07" in rewritten(text)
    # A move of rotary axes alone has its feed in degrees per minute, whatever the units.
    plan = planned("G20 G61.1\nG1 A10 F99999\nM2\n", "rotary-table")
    result = feedplan.planned_program(plan)
    top = np.abs(plan.at(np.linspace(0.0, plan.time, 2001)).velocity).max()
    assert float(result.changes.after[0]) == pytest.approx(60.0 * top, rel=1e-3)
    assert again(result, "rotary-table").feed[0] <= top * (1.0 + 1e-4)


def test_a_feed_per_turn_and_inverse_time_stay_in_their_mode() -> None:
    text = "G21 G61.1 S1000 M3\nG95 G1 X5 F60\nG94 X10 F60000\nG93 X15 F3000\nG94 X20 F60\nM2\n"
    lines = rewritten(text).splitlines()
    # 122.47 mm/s are 7.3484 mm per turn at 1000/min, and in inverse time 1469.6/min for 5 mm.
    assert [line.split("F")[1] for line in lines[1:5]] == ["7.3484", "7348.4", "1469.6", "60"]


def test_the_programs_feed_comes_back_before_lines_that_rely_on_it() -> None:
    text = (
        "G21 G61.1\no100 sub\nG1 Y5\no100 endsub\nG1 X5 F60000\no100 call\nX10\no101 repeat [2]\nG91 X3\n"
        "G90\no101 endrepeat\nX40\nM2\n"
    )
    result = feedplan.planned_program(planned(text))
    assert result.content.decode() == (
        "G21 G61.1\no100 sub\nG1 Y5\no100 endsub\nG1 X5 F7348.4\nF60000\no100 call\nX10 F7348.4\nF60000\n"
        "o101 repeat [2]\nG91 X3\nG90\no101 endrepeat\nX40 F16099\nM2\n"
    )
    assert [line for line, _ in result.left] == [3, 9]
    assert "line 3, 9" in result.summary()


def test_a_feed_that_is_set_in_a_call_is_known_from_the_moves() -> None:
    text = "G21 G61.1\no1 sub\nG1 X1 F30000\no1 endsub\nF60000\no1 call\nX6\nX300\nM2\n"
    # F30000, 500 mm/s, stays in force after the call: X6 peaks at F7348.4, and X300 reaches F30000.
    assert rewritten(text).splitlines()[6:8] == ["X6 F7348.4", "X300 F30000"]


def test_computed_feeds_and_given_ones_are_replaced() -> None:
    text = "G21 G61.1\n#1=60000\nG1 F[2 * [#1 / 2]]X5 (far)\nX10 F[#1 / 2]\nX300\nM2\n"
    lines = rewritten(text).splitlines()
    assert lines[2:5] == ["G1 F7348.4X5 (far)", "X10 F7348.4", "X300 F30000"]
    assert feeds_of("\n".join(lines))[5] == 500.0
    without = feedplan.plan(b"G21 G61.1\nG1 X5\nX300\nM2\n", "mill", feed=400.0)
    assert feedplan.planned_program(without).content == b"G21 G61.1\nG1 X5 F7348.4\nX300 F24000\nM2\n"


def test_lines_behind_the_end_and_in_a_subprogram_are_left() -> None:
    text = "G21 G61.1\nG1 X5 F60000\nM98 P7 L2\nX0\nM2\nO7\nY5\nY0\nM99\n"
    result = feedplan.planned_program(planned(text))
    assert [line for line, _ in result.left] == [7, 8]
    assert result.content.decode().splitlines()[2:5] == ["F60000", "M98 P7 L2", "X0 F7348.4"]


def test_lines_of_macros_are_left() -> None:
    text = "G21 G61.1\nG1 X5 F60000\nG65 P7 X9 F8\nG1 X0\nM2\nO7\nG1 Y#24\nY0\nM99\n"
    assert rewritten(text).splitlines()[1:5] == ["G1 X5 F7348.4", "F60000", "G65 P7 X9 F8", "G1 X0 F7348.4"]
    text = "G21 G61.1\n#1=0\nN1 G1 X[5*#1] F60000\n#1=#1+1\nIF [#1 LE 3] GOTO 1\nM2\n"
    assert rewritten(text) == text


def test_threads_and_taps_keep_the_feed_of_their_spindle() -> None:
    text = "G21 G61.1 S1000 M3\nG1 X5 F60000\nG33 Z-5 K1\nZ-8 K1\nG1 X0\nM2\n"
    result = feedplan.planned_program(planned(text))
    assert [line for line, _ in result.left] == [3, 4]
    assert result.content.decode().splitlines()[1:5] == ["G1 X5 F7348.4", "F60000", "G33 Z-5 K1", "Z-8 K1"]


def test_a_cycle_has_the_greatest_feed_of_its_moves() -> None:
    text = "G21 G61.1\nG0 Z5\nG99 G81 X0 Y0 Z-5 R1 F60000\nX10\nG80\nM2\n"
    result = feedplan.planned_program(planned(text))
    # 6 mm of Z from rest to rest at 2500 mm/s².
    assert result.content.decode().splitlines()[2:4] == ["G99 G81 X0 Y0 Z-5 R1 F7348.4", "X10"]


def test_deleted_blocks_keep_the_feed_that_they_rely_on() -> None:
    text = "G21 G61.1\nG1 X5 F60000\n/X7\nX10\nM2\n"
    result = feedplan.planned_program(planned(text))
    assert result.content.decode().splitlines()[1:4] == ["G1 X5 F7348.4", "F60000", "/X7"]


def test_the_feed_of_a_tip_is_that_of_the_tip() -> None:
    text = "G21 G43.1 Z80\nG0 X0 Y0 Z100\nG43.4\nG61.1\nG1 X20 A-20 F60000\nX40 A0\nG49\nM2\n"
    plan = planned(text, "trunnion-ac")
    result = feedplan.planned_program(plan)
    program = again(result, "trunnion-ac")
    lengths = np.linspace(0.0, plan.trajectory.length, 4001)
    moves = program.kind != MoveKind.RAPID
    assert plan.program is not None
    assert (program.feed[moves] < plan.program.feed[moves]).any()
    assert program.feed[moves].max() <= plan.trajectory.speed(lengths).max() * 1.001


def test_rapids_have_no_feed() -> None:
    text = "G21 G61.1\nG1 X5 F60000\nG0 X9 F700\nG1 X14\nM2\n"
    assert "G0 X9 F700\n" in rewritten(text)
    assert rewritten("G21\nG0 X9\nM2\n") == "G21\nG0 X9\nM2\n"


def test_letters_that_are_no_feed_words_are_left() -> None:
    text = "(F5)\nG21 G61.1 ;F6\n#<f1>=3\nG1 X[#<f1>+2] F60000 (F7)\nM117 F8\nX10\nM2\n"
    assert rewritten(text).splitlines()[:6] == [
        "(F5)",
        "G21 G61.1 ;F6",
        "#<f1>=3",
        "G1 X[#<f1>+2] F7348.4 (F7)",
        "M117 F8",
        "X10",
    ]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends_stay(end: str) -> None:
    text = end.join(["G21 G61.1", "G1 X5 F60000", "/X7", "X10", "M2"])
    result = rewritten(text)
    assert result == end.join(["G21 G61.1", "G1 X5 F7348.4", "F60000", "/X7", "X10 F7348.4", "M2"])


def test_lines_are_asides_in_flow_alone() -> None:
    text = b"O1000 (name)\no1 if [1]\no2 do\nX1\no2 while [0]\no1 endif\nX2\nM30\nX3\n"
    assert blocks_of(text).exclusion.tolist() == [
        Exclusion.NO,
        *[Exclusion.FLOW] * 5,
        Exclusion.NO,
        Exclusion.NO,
        Exclusion.FLOW,
    ]


def test_feeds_are_rounded_down_to_five_digits() -> None:
    feeds = np.array([123456.7, 7348.469, 0.00012345678, 20.0, 99999.99, 0.3])
    texts = feed_texts(rounded_down(feeds))
    assert texts == [b"123450", b"7348.4", b"0.00012345", b"20", b"99999", b"0.3"]
    assert feed_texts(np.array([20.0, 0.3]), point=True) == [b"20.", b"0.3"]
    random = np.random.default_rng(3).uniform(1e-3, 1e6, 5000)
    read = np.array([float(text) for text in feed_texts(rounded_down(random))])
    assert (read <= random).all()
    assert (read >= random * (1.0 - 1.0001e-4)).all()


def test_inverse_time_bounds_the_speed_and_not_the_mean() -> None:
    text = "G21 G94 G61.1\nG0 X0\nG1 X30 F60000\nX0 Y40 F700\nG2 X0 Y0 J-20\nM2\n"
    result = feedplan.planned_program(planned(text), inverse_time=True)
    # 300 mm/s over 30 mm are 600 a minute; 11.66 mm/s over 50 mm 14; half a circle of 62.83 mm.
    assert result.content.decode() == (
        "G21 G93 G61.1\nG0 X0\nG1 X30 F600\nX0 Y40 F14\nG2 X0 Y0 J-20 F11.14\nM2\n"
    )
    assert again(result).feed.tolist() == pytest.approx([300.0, 700 / 60, 700 / 60], rel=1e-4)


def test_inverse_time_begins_at_the_first_feed_and_is_for_plain_moves() -> None:
    text = "G21\nG0 X0\nG1 X30 F600\nX30\nM2\n"
    assert rewritten(text, inverse_time=True) == "G21\nG0 X0\nG1 X30 F20 G93\nX30 F1\nM2\n"
    with pytest.raises(InputError, match=r"line 3: several moves, as of a cycle: inverse time \(G93\)"):
        rewritten("G21 F600\nG0 Z5\nG81 X3 Z-5 R1\nM2\n", inverse_time=True)
    spline = "G21 F600\n\n\nG0 X1\nG5 X9 Y9 I3 J3 P-3 Q-3\nM2\n"
    for expand in (False, True):
        with pytest.raises(
            InputError, match=r"line 5: a spline: inverse time .* arcs: leave out --inverse-time$"
        ):
            rewritten(spline, inverse_time=True, expand=expand)
    with pytest.raises(InputError, match=r"has no feed moves: .*: leave out --inverse-time$"):
        rewritten("G21\nG0 X3\nM2\n", inverse_time=True)


def test_what_has_no_text_is_refused_with_the_remedy() -> None:
    path = feedplan.Path.from_points([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]], 0.01)
    with pytest.raises(InputError, match="the plan of a program"):
        feedplan.planned_program(feedplan.plan(path, "mill"))
    drawn = b'{"unit": "mm", "curves": [{"degree": 1, "control_points": [[0, 0, 0], [9, 0, 0]]}]}'
    plan = feedplan.plan(drawn, "mill")
    with pytest.raises(InputError, match=r"is no G-code .* --expand"):
        feedplan.planned_program(plan)
    with pytest.raises(
        InputError, match="there is no dialect 'heidenhain': use one of linuxcnc, grbl, fanuc"
    ):
        feedplan.planned_program(planned(SQUARE), dialect="heidenhain")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="feed_step is -1 mm/s: give a positive number"):
        feedplan.planned_program(planned(SQUARE), feed_step=-1.0)


def test_a_program_that_was_changed_since_is_refused(tmp_path: object) -> None:
    from pathlib import Path

    file = Path(str(tmp_path)) / "part.ngc"
    file.write_text(SQUARE)
    plan = feedplan.plan(file, "mill")
    file.write_text(SQUARE + "\n")
    with pytest.raises(InputError, match=r"part\.ngc was changed since it was planned: plan it again"):
        feedplan.planned_program(plan)


def test_a_program_without_a_feed_gets_that_of_the_user() -> None:
    """The first feed move gets the feed, because a control refuses a feed move before the first F."""
    text = "G21 G90\nG0 Y1\nG1 X10\nX20\nX30\nF1200 X40\nX50\nM2\n"
    result = feedplan.planned_program(feedplan.plan(text, "mill", feed=10.0))
    assert result.content.decode() == ("G21 G90\nG0 Y1\nG1 X10 F600\nX20\nX30\nF600 X40\nX50\nM2\n")
    again = feedplan.plan(result.content, "mill")
    assert again.time == pytest.approx(feedplan.plan(text, "mill", feed=10.0).time, rel=1e-12)
    # With inverse time, too, the summary says that the line had no F.
    told = feedplan.planned_program(feedplan.plan("G1 X10\nM2\n", "mill", feed=10.0), inverse_time=True)
    assert "line 1: no F -> F60" in told.summary()


def test_the_feed_before_inverse_time_may_stand_in_a_line_of_its_own() -> None:
    result = feedplan.planned_program(planned("G21\nF600\nG1 X10\n/F900\nX20\nM2\n"), inverse_time=True)
    assert result.summary().splitlines()[1:] == ["  line 3: F600 -> F60", "  line 5: F600 -> F60"]
