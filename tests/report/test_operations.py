"""Time per tool and operation, by hand: subprograms, tool changes, dwells; their sum is the plan's time."""

from __future__ import annotations

import pytest

import feedplan
from feedplan import Axis, InputError, Machine, Path
from feedplan.report.operations import OperationTime, by_tool

# 100 mm/s are reached after 0.1 s and 5 mm, so 20 mm from rest to rest take 0.3 s.
MACHINE = Machine("hand", [Axis(name, 100.0, 1000.0) for name in "XYZ"])
HEAD = "G21 G90 G61\nF6000\n"


def operations(text: str, change: float = 0.0) -> list[tuple[object, ...]]:
    plan = feedplan.plan(HEAD + text, MACHINE)
    rows = plan.operations(change)
    assert sum(row.time for row in rows) == pytest.approx(plan.time + change * text.count("M6"))
    return [
        (row.tool, row.name, *(round(part, 6) for part in (row.feed, row.rapid, row.dwell, row.change)))
        for row in rows
    ]


def test_feed_rapid_and_dwell_by_hand() -> None:
    text = "(FACE)\nT1 M6\nG1 X20\nG4 P0.5\nG0 X0\n(POCKET)\nG1 Y20\nY40\nM2\n"
    assert operations(text) == [(1, "FACE", 0.3, 0.3, 0.5, 0.0), (1, "POCKET", 0.5, 0.0, 0.0, 0.0)]


def test_a_tool_change_and_a_dwell_belong_to_what_follows() -> None:
    text = "(ONE)\nT1 M6\nG1 X20\nT2 M6\nM3 S1000\nG4 P2\nG0 X0\n(TWO)\nG1 Y20\nM2\n"
    assert operations(text, 7.0) == [(1, "ONE", 0.3, 0.0, 0.0, 7.0), (2, "TWO", 0.3, 0.3, 2.0, 7.0)]


def test_a_tool_without_a_comment_has_no_operation_name() -> None:
    text = "(HEADER)\n(OF TWO LINES)\nT1 M6\nG1 X20\nT12 M6\nG1 X0\nM2\n"
    assert operations(text) == [(1, "HEADER", 0.3, 0.0, 0.0, 0.0), (12, "", 0.3, 0.0, 0.0, 0.0)]


def test_before_the_first_tool_the_number_is_none() -> None:
    assert operations("G1 X20\nT3 M6\nG1 X0\nM2\n") == [(None, "", 0.3, 0, 0, 0), (3, "", 0.3, 0, 0, 0)]


def test_t_alone_changes_the_tool_where_m6_never_does() -> None:
    assert operations("T101\nG1 X20\nT202\nG1 X0\nM2\n") == [(101, "", 0.3, 0, 0, 0), (202, "", 0.3, 0, 0, 0)]


def test_subprograms_count_where_they_are_called() -> None:
    text = (
        "(ONE)\nS1000 M3\nM98 P7\n(TWO)\nG90 G1 Y20\nM98 P7\nM30\nO0007 (A SQUARE)\nG91 G1 X20\nX-20\nM99\n"
    )
    assert operations(text) == [(None, "ONE", 0.6, 0, 0, 0), (None, "TWO", 0.9, 0, 0, 0)]
    text = (
        "o<side> sub\nG91 G1 X20\nG90\no<side> endsub\n(ONE)\nM8\no<side> call\n(TWO)\nM9\no<side> call\nM2\n"
    )
    assert operations(text) == [(None, "ONE", 0.3, 0, 0, 0), (None, "TWO", 0.3, 0, 0, 0)]


def test_comments_with_a_command_or_an_end_give_no_name() -> None:
    text = (
        "(FINISH OPERATION: A)\n(MSG, hello)\n; ---\n(BEGIN OPERATION: B)\nG1 X20\n"
        "(END OF OPERATION)\nG1 X0\nN7 (C)\nG1 X20 (D)\n;\x1b[31mE\nG1 X0\nM2\n"
    )
    names = [(row[1], row[2]) for row in operations(text)]
    assert names == [("BEGIN OPERATION: B", 0.6), ("C", 0.3), ("[31mE", 0.3)]


def test_loops_come_back_to_their_operation() -> None:
    text = "#1=0\no1 while [#1 LT 2]\n(A)\nG1 X20\n(B)\nG1 X0\n#1=[#1+1]\no1 endwhile\nM2\n"
    assert operations(text) == [(None, "A", 0.6, 0, 0, 0), (None, "B", 0.6, 0, 0, 0)]


def test_rows_of_one_tool_add_up() -> None:
    rows = [
        OperationTime(1, "A", 2, 1.0, 2.0),
        OperationTime(2, "B", 3, 4.0),
        OperationTime(1, "C", 4, 0.5, 0, 3.0),
    ]
    assert by_tool(rows) == (OperationTime(1, "", 0, 1.5, 2.0, 3.0), OperationTime(2, "", 0, 4.0))


def test_a_path_has_no_operations_and_the_time_of_a_change_is_not_negative() -> None:
    path = feedplan.plan(Path.from_points([[0, 0, 0], [20, 0, 0], [30, 5, 0]], tolerance=0.1), MACHINE)
    with pytest.raises(InputError, match="a path has no operations: give a program"):
        path.operations()
    plan = feedplan.plan(HEAD + "G1 X20\nM2\n", MACHINE)
    with pytest.raises(InputError, match="the time of a tool change is -1 s: give a time"):
        plan.operations(-1)


def test_a_program_without_moves_has_the_times_of_its_dwells() -> None:
    plan = feedplan.plan(HEAD + "T1 M6\n(WAIT)\nG4 P2\nG1 X20\nG1 X20\nM2\n", MACHINE)
    assert [(row.name, row.dwell) for row in plan.operations()] == [("WAIT", 2.0)]
