"""The section "gained" of the page is made from plan.json."""

from __future__ import annotations

import json
import re
from pathlib import Path

from feedplan.cli import main
from feedplan.report.gained import gained

SUMMARY = {
    "time": 60.0,
    "lower_bound": 59.0,
    "today": {"controller": "grbl", "time": 80.0, "saved": 20.0},
    "one_step_more": [{"limit": "feed", "factor": 1.2, "time": 54.0, "saved": 6.0}],
    "planned_program": {"file": "program.ngc", "changed": 3, "lines": 9, "split": 0, "left": 1},
}


def cells(text: str) -> list[str]:
    return [cell for cell in re.findall(r"<td[^>]*>([^<]+)</td>", text) if cell.strip()]


def test_the_gain_is_shown_in_numbers() -> None:
    assert cells(gained(SUMMARY)) == [
        *("Today, by grbl", "1 min 20.0 s", "By the plan", "1 min 00.0 s", "Saved", "20.000 s, 25.0 %"),
        *("feed × 1.2", "6.000 s less, 10.0 %"),
        *("3 lines of 9 with another F", "program.ngc", "0 split, 1 left as they were"),
    ]
    slower = {**SUMMARY, "today": {"controller": "grbl", "time": 50.0, "saved": -10.0}}
    assert "Longer by" in gained(slower)
    assert "No plan of this path within the limits is as fast" in gained(slower)
    assert gained({"time": 60.0, "today": None}) == ""


def test_the_command_puts_it_on_the_page_and_in_plan_json(tmp_path: Path) -> None:
    file = tmp_path / "part.ngc"
    file.write_text("G21 G90 G64 P0.02\nG1 F60000 X20\nY20\nX0\nM2\n")
    options = ["--machine", "mill", "--controller", "linuxcnc", "--one-step-more", "--program"]
    assert main(["plan", str(file), *options, "-o", str(tmp_path / "out"), "--quiet"]) == 0
    summary = json.loads((tmp_path / "out" / "plan.json").read_text("utf-8"))
    assert summary["one_step_more"][0]["saved"] > 0.0
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert gained(summary) in page
    assert "Today, by linuxcnc" in page
