"""The post-processor for FreeCAD in examples/, run by FreeCAD without a display."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import feedplan
from benchmarks.named import EXAMPLES
from feedplan.program.program import MoveKind

ROOT = EXAMPLES.parent
FREECAD = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")

# The outline of a box at three levels, and three holes beside it.
JOB = """
import json, sys
sys.path.insert(0, {examples!r})
import FreeCAD, Path, feedplan_post
try:
    from Path.Main import Job
    from Path.Op import Profile
except ImportError:
    from PathScripts import PathJob as Job, PathProfile as Profile

document = FreeCAD.newDocument("part")
box = document.addObject("Part::Box", "Box")
box.Length, box.Width, box.Height = 60, 40, 10
document.recompute()
job = Job.Create("Job", [box], None)
tool = job.Tools.Group[0]
tool.HorizFeed, tool.VertFeed, tool.SpindleSpeed = "12000 mm/min", "600 mm/min", 8000
Profile.Create("Profile")
holes = document.addObject("Path::Feature", "Holes")
drill = [Path.Command("G0", dict(X=-20, Y=0, Z=12)), Path.Command("G98")]
drill += [Path.Command("G81", dict(X=-20, Y=10 * k, Z=-3, R=12, F=5)) for k in range(3)]
holes.Path = Path.Path([*drill, Path.Command("G80")])
document.recompute()
objects = [*job.Tools.Group, *job.Operations.Group, holes]
feedplan_post.export(objects, {plain!r}, "--unplanned --no-show-editor")
feedplan_post.export(objects, {planned!r}, {options!r})
try:
    feedplan_post.export(objects, {planned!r}, {refused!r})
except RuntimeError as error:
    print("refused:", error, flush=True)
"""


@pytest.mark.skipif(FREECAD is None, reason="FreeCAD is not installed: apt-get install freecad-python3")
def test_freecad_posts_a_job_with_planned_feeds(tmp_path: Path) -> None:
    command = shlex.join(["env", f"PYTHONPATH={ROOT}", sys.executable, "-m", "feedplan"])
    options = shlex.join(["--feedplan", command, "--machine", "mill"])
    plain, planned, script = (tmp_path / name for name in ("plain.ngc", "planned.ngc", "job.py"))
    script.write_text(
        JOB.format(
            examples=str(EXAMPLES),
            plain=str(plain),
            planned=str(planned),
            options=options,
            refused=f"{options} --tolerance -1",
        ),
        encoding="utf-8",
    )
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        [str(FREECAD), str(script)],
        env=environment | {"HOME": str(tmp_path), "QT_QPA_PLATFORM": "offscreen"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=120,
    )
    said = done.stdout + done.stderr
    assert planned.exists(), said
    assert "refused: " in said, said
    assert "tolerance" in said.split("refused: ")[1], said

    own = feedplan.read_program(plain, "mill")
    program = feedplan.read_program(planned, "mill")
    assert np.array_equal(program.target, own.target)
    assert (program.kind == own.kind).all()
    assert (own.kind == MoveKind.ARC).sum() >= 12
    cutting = np.isfinite(own.feed)
    assert set(own.feed[cutting].tolist()) == {5.0, 10.0, 200.0}
    assert (program.feed <= own.feed * (1.0 + 1e-9)).all()
    assert (program.feed[cutting] < own.feed[cutting]).any()
    words = [word for word in own.events.words() if not word.startswith("(")]
    assert words[-4:] == ["M3", "M5", "M9", "M2"]
    plan, again = (feedplan.plan(each, "mill") for each in (own, program))
    assert again.time == pytest.approx(plan.time, rel=0.02)
