"""The page of the service in a browser: drop, progress, drawing, cursor, comparison, what-if and downloads.

FEEDPLAN_PICTURES names a folder for pictures, FEEDPLAN_PROGRAM the program that they show.
"""

from __future__ import annotations

import itertools
import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

import feedplan
from feedplan.machine.controller import Controller
from feedplan.machine.machine import Machine
from feedplan.outputs import npz
from feedplan.report.page import missing_pictures
from tests.report.drawn import unpacked
from tests.service.servers import Server, running

ROOT = Path(__file__).parents[2]
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PROGRAM = Path(os.environ.get("FEEDPLAN_PROGRAM", ROOT / "examples" / "part.ngc"))
TOKEN = "t" * 40


def _missing() -> str:
    if missing_pictures():
        return "the drawing code is not built: make page"
    if CHROMIUM is None:
        return "chromium is missing: apt-get install chromium"
    if not (ROOT / "page" / "node_modules" / "playwright-core").is_dir():
        return "playwright-core is missing: npm ci in the folder page"
    return ""


in_a_browser = pytest.mark.skipif(bool(_missing()), reason=_missing())


def _with_token(folder: Path) -> tuple[str, str]:
    """The options of a server with a token."""
    file = folder / "token"
    file.write_text(TOKEN, encoding="ascii")
    return "--token-file", str(file)


def _used(address: str, program: Path, folder: Path, *token: str) -> dict[str, Any]:
    """The facts that the script with the user's actions has collected."""
    command = ["node", str(ROOT / "page" / "test" / "page.mjs"), address, str(program), str(folder), *token]
    done = subprocess.run(
        command, env={**os.environ, "CHROMIUM": str(CHROMIUM)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    facts: dict[str, Any] = json.loads((folder / "facts.json").read_text("utf-8"))
    return facts


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    given = os.environ.get("FEEDPLAN_PICTURES")
    place = Path(given).resolve() if given else tmp_path_factory.mktemp("page")
    place.mkdir(parents=True, exist_ok=True)
    return place


@pytest.fixture(scope="module")
def facts(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    place = tmp_path_factory.mktemp("store")
    with running(place / "jobs", "--workers", "2", *_with_token(place), token=TOKEN) as server:
        return {**_used(server.url, PROGRAM, folder, TOKEN), "address": server.url}


@in_a_browser
def test_the_token_is_asked_for_once_and_sent_as_a_header_to_the_service_only(
    facts: dict[str, Any],
) -> None:
    # The browser reports two refusals by the service: the missing token, and a wrong limit.
    assert [error for error in facts["errors"] if "401" not in error and "422" not in error] == []
    assert facts["machines"] > 10
    addresses = [one for one in facts["requests"] if not one["url"].startswith(("data:", "blob:"))]
    assert all(one["url"].startswith(facts["address"]) for one in addresses)
    asked = [one for one in addresses if "/v1/" in one["url"]]
    without = [one for one in asked if not one["hasToken"]]
    assert len(asked) > 15
    assert len(without) == 1


@in_a_browser
def test_a_dropped_program_is_planned_with_progress_and_drawn(facts: dict[str, Any]) -> None:
    assert {"read", "plan", "audit", "write"} & set(facts["stages"])
    assert "passed" in facts["figures"]
    assert facts["path"]["count"] > 2000
    assert facts["path"]["colours"] > 5


@in_a_browser
def test_colours_tell_feed_active_limit_and_time_lost(facts: dict[str, Any]) -> None:
    assert "mm/s" in facts["feed"]["legend"]
    assert "acceleration" in facts["active"]["legend"]
    assert "of the time there" in facts["lost"]["legend"]
    assert all(facts[mode]["count"] > 1000 for mode in ("feed", "active", "lost"))


@in_a_browser
def test_the_cursor_is_in_chart_path_and_source(facts: dict[str, Any]) -> None:
    lines = PROGRAM.read_text("ascii").splitlines()
    for seen in (facts["pointed"], facts["slowest"]):
        number = int(seen["line"])
        assert seen["told"].startswith(f"line {number} ") or seen is facts["slowest"]
        assert seen["text"].startswith(f"{number}{lines[number - 1]}"[:40])
    assert facts["slowest"]["row"].startswith(facts["slowest"]["line"])
    assert "mm/s" in facts["axesTold"]
    assert facts["found"]["tip"].startswith("line ")
    assert facts["found"]["told"].startswith("line ")


@in_a_browser
def test_dragging_zooms_and_a_double_click_shows_all_again(facts: dict[str, Any]) -> None:
    assert facts["zooms"]
    assert facts["zoomsBack"]


@in_a_browser
def test_it_plays_and_stops_by_a_key(facts: dict[str, Any]) -> None:
    one, other = facts["clock"]
    assert one == other
    assert not one.startswith("0:00.")


@in_a_browser
def test_the_controller_of_today_is_drawn_beside_the_plan(facts: dict[str, Any]) -> None:
    assert facts["today"]["name"].partition(" · ")[2] == "grbl (machine file)"
    assert "grbl (machine file)" in facts["today"]["figures"]
    assert facts["today"]["path"]["count"] > 1000
    assert facts["today"]["first"]["count"] > 1000


@in_a_browser
def test_the_controller_has_the_settings_of_the_machine_file_and_others_where_they_are_given(
    facts: dict[str, Any],
) -> None:
    assert facts["offered"][:2] == ["nothing", "grbl (machine file)"]
    assert {"linuxcnc", "klipper", "marlin", "jerk-limited"} <= set(facts["offered"])
    assert facts["today"]["settings"] == [
        ["junction_deviation", "0.03", "machine file"],
        ["arc_tolerance", "0.002", "default"],
        ["block_buffer_size", "15", "default"],
    ]
    assert facts["today"]["options"] == {"deviation": 0.03, "arc_tolerance": 0.002, "blocks": 15}
    assert facts["otherSettings"][0] == ["junction_deviation", "0.5", "given here"]
    assert facts["otherOptions"]["deviation"] == 0.5


@in_a_browser
def test_a_machine_file_is_read_as_the_service_reads_it(facts: dict[str, Any]) -> None:
    rest = [["Ymm", "-80, 90", "1000", ""], ["Zmm", "50", "500", ""]]
    assert facts["limits"] == [["Xmm", "100", "1000", "20000"], *rest]
    assert facts["refusedLimit"].startswith("axis X: max_velocity is -1")
    assert facts["changedLimits"] == [["Xmm", "120", "1000", "20000"], *rest]
    machine = Machine.from_toml(facts["changedText"], "changed")
    assert machine.axis("X").max_velocity == 120.0
    assert machine.controller == Controller("grbl", {"junction_deviation": 0.03})


@in_a_browser
def test_a_refused_program_is_shown_with_line_and_remedy(facts: dict[str, Any]) -> None:
    assert facts["refused"].startswith("wrong.ngc line 3: ")


@in_a_browser
def test_a_slider_plans_again_at_once_and_back(facts: dict[str, Any]) -> None:
    assert "\N{MINUS SIGN}" in facts["whatIf"]["told"]
    assert "feed 174 %" in facts["whatIf"]["figures"]
    assert "feed 174 %" in facts["whatIf"]["legend"]
    assert facts["asPlanned"]


@in_a_browser
def test_downloads_are_complete(facts: dict[str, Any], folder: Path) -> None:
    stem = PROGRAM.stem
    assert facts["downloads"] == [f"{stem}-setpoints.npz", f"{stem}-report.html", PROGRAM.name]
    assert len(npz.load(folder / facts["downloads"][0])) > 1000
    assert "Audit passed" in (folder / facts["downloads"][1]).read_text("utf-8")
    assert (folder / facts["downloads"][2]).read_bytes() == PROGRAM.read_bytes()


@in_a_browser
def test_it_fits_a_tablet(facts: dict[str, Any]) -> None:
    assert facts["tooWide"] <= 0


@pytest.mark.skipif(shutil.which("node") is None, reason="node is missing: install Node.js 20 or newer")
def test_levels_of_detail_join_and_are_within_their_tolerances() -> None:
    command = ["node", str(ROOT / "page" / "test" / "detail.mjs")]
    told = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    ends = [chunk["ends"] for chunk in told["chunks"]]
    assert len(ends) > 2
    assert [first for first, _ in ends] == [0, *(last for _, last in ends[:-1])]
    assert ends[-1][1] == told["count"] - 1
    for chunk in told["chunks"]:
        assert chunk["outside"] < 1e-6
        levels = chunk["levels"]
        assert len(levels) > 1
        assert all(level["ends"] == chunk["ends"] for level in levels)
        assert all(a["points"] > b["points"] for a, b in itertools.pairwise(levels))
        assert all(level["off"] <= level["tolerance"] for level in levels)


@pytest.mark.skipif(shutil.which("node") is None, reason="node is missing: install Node.js 20 or newer")
def test_a_chart_shows_the_end_of_its_curve_and_numbers_of_its_width() -> None:
    command = ["node", str(ROOT / "page" / "test" / "curve.mjs")]
    told = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert told["drawn"][0] == told["drawn"][-1] == 0.0
    assert max(told["drawn"]) == 30.0
    plain = [text.replace("\u202f", " ").replace("\u2212", "-") for text in told["ticks"]]
    assert plain == ["0", "-2 000", "3e7", "-3e7", "-5e6", "1e6", "-1e6", "2.5e-7", "-1.234e-5"]


def test_the_page_needs_no_token_and_allows_no_other_origin(tmp_path: Path) -> None:
    with running(tmp_path / "store", *_with_token(tmp_path)) as server:
        for address, kind in (("/", "text/html"), ("/page.js", "text/javascript"), ("/page.css", "text/css")):
            if missing_pictures() and address != "/":
                continue
            answer = server.get(address)
            assert (answer.status, answer.headers["content-type"].split(";")[0]) == (200, kind)
        assert server.get("/docs").status == 401
        if not missing_pictures():
            policy = server.get("/").headers["content-security-policy"]
            assert "default-src 'none'" in policy
            assert "connect-src 'self'" in policy


def test_the_drawing_is_sent_as_bytes(server: Server) -> None:
    job = server.planned()
    data = unpacked(server.get(f"/v1/jobs/{job['id']}/drawing").content)
    assert data["axes"] == ["X", "Y", "Z"]
    assert data["path"]["time"][-1] == pytest.approx(job["result"]["time"], abs=0.01)
    assert data["path"]["length"][-1] == pytest.approx(data["length"]["speed"]["x"][-1], rel=1e-3)
    assert set(data["path"]["line"]) == {3, 4, 5}


@in_a_browser
@pytest.mark.parametrize(
    ("program", "machine", "limits"),
    [
        ("part.ngc", "mill", "X 500, Y 500, Z 400 mm/s"),
        ("bar.ngc", "rotary-table", "X 500, Y 500, Z 400 mm/s, A 180 deg/s"),
    ],
)
def test_the_legend_of_a_report_leaves_the_limits_readable(
    program: str, machine: str, limits: str, tmp_path: Path
) -> None:
    feedplan.write_plan(feedplan.plan(ROOT / "examples" / program, machine), tmp_path, formats=[])
    for width in (400, 1080, 1280):
        seen = _seen(tmp_path / "report.html", width)
        assert seen["drawn"]
        assert [head["text"] for head in seen["heads"] if head["covered"]] == []
        assert seen["heads"][1]["text"].endswith(f"limits {limits}")
        # Both speed charts show their unit, and that they are cut at the top.
        assert re.fullmatch(r"speed \[mm/s\]  rapids up to \d+\.\d mm/s run out of the chart", seen["length"])
        assert seen["heads"][0]["text"] == seen["length"]


@in_a_browser
def test_the_legend_of_many_setpoints_leaves_the_limits_readable(tmp_path: Path) -> None:
    """Curves with more setpoints than pixels are drawn as means with ranges, and the legend says so."""
    steps = "\n".join(f"X{k % 2} Y{0.01 * k:.2f} Z{0.1 * (k % 3):.1f}" for k in range(3000))
    program = f"G21 G90 G64 P0.05\nG1 F3000\n{steps}\nM2\n"
    feedplan.write_plan(feedplan.plan(program, "mill"), tmp_path, formats=[])
    seen = _seen(tmp_path / "report.html", 1200)
    assert [head["text"] for head in seen["heads"] if head["covered"]] == []
    assert seen["heads"][2]["names"] == [f"{axis}, mean and range" for axis in "XYZ"]


@in_a_browser
def test_a_report_of_joints_alone_draws_no_tool_path(tmp_path: Path) -> None:
    axes = tuple(feedplan.Axis(name, 2.0, 10.0, unit="rad") for name in ("j1", "j2"))
    path = feedplan.Path.from_bezier([[0, 0], [1, 0], [1, 1]], axes=("j1", "j2"))
    feedplan.write_plan(feedplan.plan(path, feedplan.Machine("arm", axes)), tmp_path, formats=[])
    seen = _seen(tmp_path / "report.html", 1280)
    assert not seen["drawn"]
    assert seen["heads"][1]["text"].endswith("limits j1 2, j2 2 rad/s")


def _seen(report: Path, width: int) -> dict[str, Any]:
    """What a browser shows of a report in a window of this width [px]."""
    command = ["node", str(ROOT / "page" / "test" / "heads.mjs"), str(report), str(width)]
    done = subprocess.run(
        command, env={**os.environ, "CHROMIUM": str(CHROMIUM)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    seen: dict[str, Any] = json.loads(done.stdout)
    return seen
