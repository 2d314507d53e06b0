"""The folder of a plan: complete, exact, and never half-written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import feedplan
from feedplan import profile, setpoints
from feedplan._solvers import Sampler
from feedplan.errors import InputError
from feedplan.outputs import load_setpoints
from feedplan.plan_folder import summary_text, write_plan
from tests.outputs.parquet import FORMATS


def test_a_folder_holds_summary_setpoints_and_report(square: Any, tmp_path: Path) -> None:
    stages: list[tuple[str, float]] = []
    written = write_plan(square, tmp_path / "out", progress=lambda stage, done: stages.append((stage, done)))
    assert [file.name for file in written] == ["plan.json", "report.html", "setpoints.npz"]
    assert all(file.is_file() for file in written)
    assert sorted(entry.name for entry in (tmp_path / "out").iterdir()) == [file.name for file in written]
    summary = json.loads((tmp_path / "out" / "plan.json").read_text())
    assert summary["time"] == 2.0
    assert summary["audit"]["jerk"] is None
    assert stages[-1] == ("write", 1.0)
    assert [done for _, done in stages] == sorted(done for _, done in stages)


@pytest.mark.parametrize("name", FORMATS)
def test_the_setpoints_are_the_plans_in_every_format(name: str, square: Any, tmp_path: Path) -> None:
    write_plan(square, tmp_path, [name], step=0.001 if name == "pvt" else None)
    read = load_setpoints(tmp_path)
    if name == "pvt":  # knots are computed, but the square's setpoints are written by hand
        np.testing.assert_allclose(read.position, square.chunk.position, atol=1e-12)
        return
    np.testing.assert_array_equal(read.position, square.chunk.position)
    np.testing.assert_array_equal(read.line, square.chunk.line)


class _Counted:
    """Wraps the native sampler; records all samplers, and how many setpoints each computes."""

    made: ClassVar[list[_Counted]] = []

    def __init__(self, *arguments: Any) -> None:
        self._own, self.rows = Sampler(*arguments), 0
        self.made.append(self)

    def chunk(self, start: int, stop: int, newton: bool) -> Any:
        self.rows += stop - start
        return self._own.chunk(start, stop, newton)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._own, name)


@pytest.mark.parametrize("interpolator", ["sarfraz", "newton"])
def test_the_motion_is_laid_out_once_and_each_setpoint_computed_once(
    interpolator: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (profile, setpoints):
        monkeypatch.setattr(module, "Sampler", _Counted)
    monkeypatch.setattr(_Counted, "made", [])
    plan = feedplan.plan("G21 G90 G1 F600 X10\nY5 M8\nM2\n", "mill", interpolator=interpolator)
    stages: dict[str, list[float]] = {}

    def tell(stage: str, done: float) -> None:
        stages.setdefault(stage, []).append(done)

    write_plan(plan, tmp_path, ["npz", "csv", "pvt"], step=0.01, progress=tell)
    assert plan.audit().ok
    assert plan.summary()["setpoints"]["count"] == plan.setpoints().count
    plan.at(0.1)
    (motion,) = _Counted.made
    assert motion.rows == motion.count
    assert list(stages) == ["audit", "write"]
    assert all(done == sorted(done) and done[-1] == 1.0 for done in stages.values())
    # Writing again computes the setpoints once more, but does not audit them.
    write_plan(plan, tmp_path)
    assert _Counted.made == [motion]
    assert motion.rows == 2 * motion.count
    # Another period needs a sampler of its own.
    assert plan.setpoints(period=0.01).count < motion.count
    assert len(_Counted.made) == 2


def test_all_formats_at_once_and_each_only_once(square: Any, tmp_path: Path) -> None:
    names = ["csv", "json", "npz"]
    written = write_plan(square, tmp_path, [*names, *names])
    assert len(written) == 2 + len(names)


def test_no_setpoints_are_written_with_format_none(square: Any, tmp_path: Path) -> None:
    written = write_plan(square, tmp_path, [])
    assert [file.name for file in written] == ["plan.json", "report.html"]


def test_two_formats_of_one_file_are_refused(square: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"npz and npz-compressed are both setpoints\.npz: ask for one"):
        write_plan(square, tmp_path / "out", ["npz", "npz-compressed"])
    assert list(tmp_path.iterdir()) == []


def test_a_failure_while_writing_leaves_no_file(
    square: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("feedplan.report.page.write_report", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_plan(square, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_is_found_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file, not a folder"):
        write_plan(object(), tmp_path / "file")  # type: ignore[arg-type]


def test_numbers_of_numpy_are_plain_in_the_summary() -> None:
    text = summary_text({"a": np.float64(0.1), "b": [np.int32(3), (float("nan"),)], "c": {"µ": True}})
    assert json.loads(text) == {"a": 0.1, "b": [3, [None]], "c": {"µ": True}}
