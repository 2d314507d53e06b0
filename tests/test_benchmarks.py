"""The benchmarks run, and compare solvers on the same problems."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent

needs_toppra = pytest.mark.skipif(
    importlib.util.find_spec("toppra") is None, reason="toppra is not installed"
)


@needs_toppra
def test_every_benchmark_runs_and_stores_its_table(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "--quick", "--output", str(tmp_path)],
        cwd=ROOT,
        env=dict(os.environ, MPLCONFIGDIR=str(tmp_path / "matplotlib")),
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    tables = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in tmp_path.glob("*.json")}
    assert set(tables) == {
        "methods",
        "planner-cost",
        "curve-cost",
        "certificate-cost",
        "audit-cost",
        "against-copp",
        "against-toppra",
        "end-to-end",
        "faster-path",
        "zhang-comparison",
        "interpolators",
        "kinematics-cost",
        "jerk",
        "time-limit",
        "size",
        "interrupts",
        "service",
        "batch",
    }
    assert all(row["equal"] == "10 of 10" for row in tables["batch"]["rows"])
    assert all(row["off [%]"] <= (10 if "chords" in row["shape"] else 2) for row in tables["size"]["rows"])
    assert all(row["error [steps]"] <= 1e-9 for row in tables["interpolators"]["rows"])
    gaps = {row["path"]: row["gap"] for row in tables["certificate-cost"]["rows"]}
    assert 0.0 < gaps.pop("butterfly, jerk-limited") < 0.016
    assert all(-1e-9 < gap < 1e-3 for gap in gaps.values())
    assert all(row["audit"] == "ok" for row in tables["end-to-end"]["rows"])
    assert all(row["audits"] == "ok" for row in tables["zhang-comparison"]["rows"])
    assert all(row["toppra's error"] <= row["accuracy"] for row in tables["against-toppra"]["rows"])
    assert all(table["computer"]["cores"] for table in tables.values())


def test_an_unknown_benchmark_is_refused_with_the_known_ones() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "speed"], cwd=ROOT, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2
    assert "no benchmark 'speed'" in done.stderr
    assert "planner-cost" in done.stderr


def test_the_published_curves_are_whole_and_say_where_they_come_from() -> None:
    curves = {
        path.stem: json.loads(path.read_text(encoding="utf-8"))
        for path in (ROOT / "benchmarks" / "curves").glob("*.json")
    }
    butterfly, fan = curves["butterfly"], curves["fan"]
    assert len(butterfly["knots"]) == len(butterfly["control_points"]) + butterfly["degree"] + 1
    assert len(butterfly["weights"]) == len(butterfly["control_points"])
    assert np.all(np.diff(butterfly["knots"]) >= 0.0)
    assert len(fan["points"]) == 89
    assert fan["points"][0] == fan["points"][-1]
    assert all(curve["source"] for curve in curves.values())
