"""The comparison of methods: its rows, and the files and the table of the command."""

from __future__ import annotations

import colorsys
import json
import logging
import os
import re
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest

import feedplan
from feedplan.cli import main
from feedplan.comparison import compare
from feedplan.errors import InputError, SolverError
from feedplan.planners import bang_bang, planner, tangential
from feedplan.report.page import missing_pictures
from tests.report.drawn import data_of

# A right angle with a tolerance, and a half circle.
PROGRAM = "G21 G90 G64 P0.05 F3000\nG0 X0 Y0 Z0\nG1 X20\nY10\nG3 X0 Y10 I-10\nM2\n"
METHODS = ("bang-bang", "tangential", "junction-deviation")


@pytest.fixture
def program(tmp_path: Path) -> Path:
    file = tmp_path / "angle.ngc"
    file.write_text(PROGRAM, encoding="ascii")
    return file


def test_the_gap_is_0_at_the_optimum_and_none_where_a_limit_is_broken(program: Path) -> None:
    exact, tangential, corners = compare(program, "mill", METHODS)
    assert exact.gap is not None
    assert 0.0 <= exact.gap < 1e-3
    assert exact.audit is not None
    assert exact.audit.ok
    acceleration = exact.worst("acceleration")
    assert acceleration is not None
    assert acceleration.ratio == pytest.approx(1.0, abs=1e-6)
    # On the circle the acceleration keeps its limit along the path, but not across it.
    broken = tangential.worst("acceleration")
    assert broken is not None
    assert broken.ratio > 1.0
    assert tangential.gap is None
    assert tangential.time < exact.time
    # The first two follow the same path and have the same lower bound; the third one follows the corners.
    assert tangential.lower_bound == exact.lower_bound
    assert corners.lower_bound != exact.lower_bound


def test_a_failed_method_has_a_reason_and_the_others_are_planned(
    program: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(problem: Any) -> Any:
        raise SolverError("the solver gave up")

    monkeypatch.setattr(tangential, "plan", fails)
    failed, exact = compare(program, "mill", ("tangential", "bang-bang"))
    assert (failed.plan, failed.time, failed.gap, failed.error) == (None, None, None, "the solver gave up")
    assert failed.to_json()["audit"] is None
    assert exact.plan is not None


def test_options_go_to_the_methods_that_have_them(program: Path) -> None:
    exact, coarse = compare(program, "mill", ("bang-bang", "clarabel"), cells=8)
    assert exact.time < coarse.time < 1.2 * exact.time
    with pytest.raises(InputError, match="bang-bang takes no cells"):
        planner("bang-bang", cells=8)


def test_wrong_comparisons_are_refused(program: Path) -> None:
    with pytest.raises(InputError, match="there is no method to compare"):
        compare(program, "mill", ())
    with pytest.raises(InputError, match="there is no method 'fastest': use one of"):
        compare(program, "mill", ("bang-bang", "fastest"))


def test_the_command_prints_one_row_a_method_and_writes_a_page_that_holds_them(
    program: Path, tmp_path: Path, capsys: Any
) -> None:
    folder = tmp_path / "comparison"
    arguments = ["compare", str(program), "--methods", ",".join(METHODS), "-o", str(folder)]
    assert main(arguments) == 0
    rows = capsys.readouterr().out.splitlines()
    assert [row.split()[0] for row in rows[1:4]] == list(METHODS)
    assert rows[1].endswith("passed")
    assert re.search(r"% [XY] line [3-5]", rows[2])
    assert rows[2].endswith("FAILED")
    content = json.loads((folder / "comparison.json").read_text(encoding="utf-8"))
    assert [row["method"] for row in content["methods"]] == list(METHODS)
    assert content["methods"][0]["time"] > content["methods"][1]["time"]
    page = (folder / "comparison.html").read_text(encoding="utf-8")
    if not missing_pictures():
        assert [path["method"] for path in data_of(page)["methods"]] == list(METHODS)
    assert "http://" not in page.split("<script")[0]
    assert page.count('class="broken-row"') == sum(not row["audit"]["ok"] for row in content["methods"])


def test_warnings_are_told_once_and_by_method(tmp_path: Path, capsys: Any) -> None:
    file = tmp_path / "angle.ngc"
    file.write_text("G21 G90 G64 P0.05 F3000\nG43 H3\nG1 X20\nY10\nM2\n")
    lengths = "line 2: the tool lengths that G43 calls for are not known"
    assert (
        main(["compare", str(file), "--methods", "bang-bang,tangential,linuxcnc", "--path", "fastest"]) == 0
    )
    told = capsys.readouterr().err.splitlines()
    assert [line.partition(":")[0] for line in told] == ["warning", "warning"]
    assert told[0].startswith(f"warning: {lengths}")
    assert told[1].startswith("warning: linuxcnc: the method linuxcnc knows one path only")
    assert main(["fit", str(file)]) == 0
    assert capsys.readouterr().err.startswith(f"warning: {lengths}")


def test_the_colours_of_methods_can_be_told_apart() -> None:
    root = Path(__file__).parent.parent
    sheet = (root / "feedplan" / "report" / "page.css").read_text("utf-8")
    script = (root / "page" / "source" / "comparison.js").read_text("utf-8")
    others = re.findall(r'"(--axis-\d)"', script)
    light, dark = (dict(re.findall(r"(--[\w-]+): #(\w{6});", part)) for part in sheet.split("@media", 1))
    assert len(set(others)) >= 6
    for colours in (light, dark):
        hue = {name: hue_of(colours[name]) for name in ("--accent", *others)}
        five = ["--accent", *others[:4]]
        for one, other in [*combinations(five, 2), *(("--accent", other) for other in others)]:
            assert hue[one] is None or hue[other] is None or 30.0 < abs(hue[one] - hue[other]) < 330.0


def hue_of(colour: str) -> float | None:
    """The hue [deg] of a colour such as `1d5f8a`; None for a grey one."""
    hue, _, saturation = colorsys.rgb_to_hls(*(int(colour[k : k + 2], 16) / 255 for k in (0, 2, 4)))
    return 360.0 * hue if saturation > 0.0 else None


def test_no_word_of_other_packages_is_printed(
    program: Path, capfd: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def wordy(*_: Any, **__: Any) -> None:
        os.write(1, b"banner of a library in C\n")
        os.write(2, b"its warning\n")
        print("banner of a package in Python")
        logging.getLogger("package").warning("its warning")
        raise SolverError("line 3: gave up")

    monkeypatch.setattr("feedplan.planners.clarabel.plan", wordy)
    assert main(["compare", str(program), "--methods", "bang-bang,clarabel"]) == 0
    out, err = capfd.readouterr()
    assert [line.split()[0] for line in out.splitlines()] == ["method", "bang-bang"]
    assert err == "clarabel: line 3: gave up\n"
    assert main(["plan", str(program), "--method", "clarabel"]) == 1
    assert capfd.readouterr() == ("", "error: line 3: gave up\n")


def test_each_method_has_ten_seconds_by_default(program: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limits: list[float | None] = []
    monkeypatch.setattr(
        "feedplan.planners.clarabel.plan",
        lambda problem, *, time_limit=None: limits.append(time_limit) or bang_bang.plan(problem),
    )
    for more in ([], ["--time-limit", "3"]):
        assert main(["compare", str(program), "--methods", "clarabel", "-q", *more]) == 0
    assert limits == [10.0, 3.0]


def test_python_compares_all_methods_with_the_same_limit_of_time(
    program: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits: list[float | None] = []
    for method in ("casadi", "clarabel", "jerk_limited", "ruckig", "toppra"):
        monkeypatch.setattr(
            f"feedplan.planners.{method}.plan",
            lambda problem, *, time_limit=None: limits.append(time_limit) or bang_bang.plan(problem),
        )
    assert tuple(row.method for row in feedplan.compare(program, "mill")) == feedplan.methods()
    assert limits == [10.0] * 5
    for limit in (3.0, None):
        feedplan.compare(program, "mill", ("clarabel",), time_limit=limit)
        assert limits.pop() == limit


def test_options_that_no_method_of_a_comparison_takes_are_refused(program: Path) -> None:
    with pytest.raises(
        InputError, match=r"no method of these takes speed: give tolerance, .*, cells, time_limit"
    ):
        feedplan.compare(program, "mill", ("bang-bang", "clarabel"), speed=3)
    with pytest.raises(InputError, match="methods is 'bang-bang': give a list of methods' names"):
        feedplan.compare(program, "mill", "bang-bang")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="the time limit is 'long': give a positive number, or None"):
        feedplan.compare(program, "mill", ("bang-bang",), time_limit="long")  # type: ignore[arg-type]


def test_a_comparison_without_any_plan_exits_1(program: Path, capsys: Any) -> None:
    code = main(["compare", str(program), "--methods", "clarabel", "--time-limit", "1e-9"])
    assert code == 1
    assert "clarabel: " in capsys.readouterr().err
