"""Plans in interactive use: short texts, a card in a notebook, copies in other processes."""

from __future__ import annotations

import pickle
from pathlib import Path as FilePath

import numpy as np
import pytest

from feedplan import Plan, plan

PROGRAM = "G21 G90 G64 P0.05\nG1 F1000\n" + "".join(f"X{i} Y{(i * 7) % 5}\n" for i in range(200)) + "M2\n"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    file: FilePath = tmp_path_factory.mktemp("programs") / "zigzag <1>.ngc"
    file.write_text(PROGRAM)
    return plan(file, "mill")


def test_every_text_is_short(made: Plan) -> None:
    problem, points = made.problem, made.setpoints()
    everything = [made, made.program, made.machine, made.path, problem, made.profile, made.trajectory]
    for thing in (*everything, made.path.curve, points, points.all(), made.audit(), made.at(0.1)):
        assert len(repr(thing)) < 300, type(thing)
    assert repr(made).startswith("<Plan of zigzag <1>.ngc on mill by bang-bang: ")
    assert repr(made.audit()).endswith("samples: every limit holds>")


def test_a_count_of_one_has_no_plural() -> None:
    one = plan("G21 G1 F1000 X10\nM2\n", "mill")
    assert one.figures()["path"] == "1 piece in 1 run"
    assert repr(one.path).endswith("1 piece in 1 run>")
    assert repr(one).endswith(", 1 piece>")
    assert ": 1 move of " in repr(one.program)
    two = plan("G21 G61 G1 F1000 X10\nY10\nM2\n", "mill")
    assert two.figures()["path"] == "2 pieces in 2 runs"


def test_objects_with_arrays_compare_by_identity(made: Plan) -> None:
    for thing in (made, made.program, made.path, made.problem, made.profile, made.path.curve):
        assert thing == thing
        assert thing != pickle.loads(pickle.dumps(thing))
        assert len({thing, thing}) == 1


def test_a_notebook_shows_a_card_with_a_small_plot(made: Plan) -> None:
    html = made._repr_html_()
    assert "zigzag &lt;1&gt;.ngc" in html
    assert f"{made.time:.6g} s" in html
    assert html.count("<svg") == html.count("<polyline") == 1
    assert len(html) < 20_000


def test_a_plan_that_is_faster_than_the_bound_is_told_as_one_that_breaks_limits(made: Plan) -> None:
    broken = plan("G21 G64 P0.05\nG1 F60000 X10\nY10\nX0\nY20\nM2\n", "mill", "tangential")
    assert broken.gap < -0.01
    assert broken.figures()["no plan within the limits is faster than"].endswith("(this one breaks limits)")
    assert "s, this one breaks limits, " in repr(broken)
    assert "(gap " in made.figures()["no plan within the limits is faster than"]


def test_plans_and_setpoints_go_to_other_processes(made: Plan) -> None:
    copy = pickle.loads(pickle.dumps(made))
    assert copy.time == made.time
    assert copy.at(0.5).position.tolist() == made.at(0.5).position.tolist()
    points = pickle.loads(pickle.dumps(made.setpoints(0.01)))
    own = np.concatenate([chunk.position for chunk in points])
    assert own.tolist() == made.setpoints(0.01).all().position.tolist()
