"""The page has the figures of the plan, loads nothing, and escapes the markup of a part program."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import feedplan
from feedplan.report.container import contained
from feedplan.report.figures import SetpointFigures, chart_data, over_length
from feedplan.report.page import SCRIPT, asset, missing_pictures, write_report
from feedplan.report.tool_path import ToolPath
from tests.report.drawn import data_of, unpacked

pytestmark = pytest.mark.skipif(bool(missing_pictures()), reason="the drawing code is not built: make page")


def page(plan: Any, file: Path, source: Path | None = None) -> str:
    account = plan.account
    figures = SetpointFigures(plan.problem, ToolPath(plan.problem), len(plan.chunk.t))
    figures.add(plan.chunk)
    for check in plan.verdict.broken:
        figures.path.mark(plan.chunk, check.time)
    write_report(
        file,
        summary=plan.summary(),
        problem=plan.problem,
        account=account,
        audit=plan.verdict,
        data=chart_data(
            plan.problem,
            account,
            figures,
            plan.verdict,
            over_length(plan.problem, plan.profile),
        ),
        text=source,
    )
    return file.read_text(encoding="utf-8")


def without_script(text: str) -> str:
    scripts = list(re.finditer(r"<script[^>]*>.*?</script>", text, flags=re.S))
    longest = max(scripts, key=lambda match: match.end() - match.start())
    assert longest.end() - longest.start() > 300_000
    return text[: longest.start()] + text[longest.end() :]


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.loads: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.loads += [value or "" for name, value in attrs if name in ("src", "href", "action", "data")]


def test_the_page_loads_nothing_and_forbids_the_browser_to(square: Any, tmp_path: Path) -> None:
    text = page(square, tmp_path / "report.html")
    reader = _Reader()
    reader.feed(without_script(text))
    assert reader.loads == []
    assert not {"link", "iframe", "img", "object", "embed"} & set(reader.tags)
    assert "default-src 'none'" in text
    assert "url(" not in without_script(text)
    assert "://" not in without_script(text)


def test_a_name_with_markup_stays_text(square: Any, tmp_path: Path) -> None:
    square.warnings = ("line 3: </script><b>bold</b>",)
    program = tmp_path / "a.ngc"
    program.write_bytes(b"a\nb\nG1 X20 (<img src=x>) \xff\nG1 Y20\nG1 X0\nG1 Y0\n")
    text = without_script(page(square, tmp_path / "report.html", program))
    assert "<title>square &lt;1&gt;.ngc" in text
    assert "&lt;/script&gt;&lt;b&gt;bold" in text
    assert "G1 X20 (&lt;img src=x&gt;) \N{REPLACEMENT CHARACTER}" in text
    assert "<img" not in text


def test_a_passed_audit_says_so(square: Any, tmp_path: Path) -> None:
    text = page(square, tmp_path / "report.html")
    assert "Audit passed" in text
    assert "2 001 checked samples" in text
    assert "FAILED" not in without_script(text)


def test_a_failed_audit_names_what_is_broken_where(broken_square: Any, tmp_path: Path) -> None:
    text = page(broken_square, tmp_path / "report.html")
    assert "Audit FAILED" in text
    assert "1 limit is broken" in text
    # Such a plan may be faster than the bound, which holds for plans that keep the limits.
    assert '<dt>Gap to the bound</dt><dd class="short">–<small></small></dd>' in text
    assert "no plan of this path that keeps the limits is faster than" in text
    assert f"<li>{broken_square.verdict.failures[0]}</li>" in text
    data = data_of(text)
    assert data["failures"] == [{"name": "acceleration", "axis": "X", "time": 0.05}]
    assert data["path"]["marks"] == [pytest.approx([0.625, 0.0, 0.0])]


def test_the_numbers_of_the_plan_are_there(square: Any, tmp_path: Path) -> None:
    text = without_script(page(square, tmp_path / "report.html"))
    for shown in (
        "2.000<small>s",
        "no plan of this path is faster",
        "80.0<small>mm",
        "2400 mm/min",
        "60.0 %",
        "not judged",
    ):
        assert shown in text


def test_the_charts_hold_the_setpoints(square: Any, tmp_path: Path) -> None:
    data = data_of(page(square, tmp_path / "report.html"))
    assert data["axes"] == ["X", "Y", "Z"]
    assert data["limits"]["jerk"] == [50_000.0, 50_000.0, None]
    speed = data["time"]["speed"]
    np.testing.assert_allclose(speed["x"], square.chunk.t, rtol=1e-7)
    assert speed["y"].max() == 50.0
    assert set(speed["line"]) == {3, 4, 5, 6}
    assert data["time"]["acceleration"][0]["y"].min() == -500.0
    assert data["length"]["cutting_speed"] == pytest.approx(50.0)
    assert "acceleration" not in data["length"]
    path = data["path"]
    corners = {(round(float(x), 3), round(float(y), 3)) for x, y in zip(path["x"], path["y"], strict=True)}
    assert {(0, 0), (20, 0), (20, 20), (0, 20)} <= corners
    assert len(path["x"]) < 400


def test_data_keeps_any_text(broken_square: Any, tmp_path: Path) -> None:
    checks = [replace(check, axis="</script>") for check in broken_square.verdict.checks]
    broken_square.verdict = replace(broken_square.verdict, checks=tuple(checks))
    data = data_of(page(broken_square, tmp_path / "report.html"))
    assert data["failures"][0]["axis"] == "</script>"


def test_a_page_without_the_script_says_that_pictures_are_missing(
    square: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("feedplan.report.page.SCRIPT", "bundle/none.js")
    text = page(square, tmp_path / "report.html")
    assert missing_pictures().endswith(
        "run `make page` in its source, which needs Node.js, and install it again"
    )
    assert missing_pictures() in text
    assert "Audit passed" in text
    assert 'class="chart"' not in text


def test_the_page_without_its_data_is_below_a_megabyte_and_a_half(square: Any, tmp_path: Path) -> None:
    assert len(page(square, tmp_path / "report.html").encode()) < 1_500_000
    assert "</script" not in asset(SCRIPT)


def test_without_the_program_the_page_lacks_only_its_text(square: Any, tmp_path: Path) -> None:
    assert "<th>Source</th>" not in page(square, tmp_path / "report.html", tmp_path / "gone.ngc")


def test_one_piece_is_told_as_one(tmp_path: Path) -> None:
    feedplan.write_plan(feedplan.plan("G21 F600\nG1 X10\nM2\n", "mill"), tmp_path, formats=[])
    assert "1 piece<" in (tmp_path / "report.html").read_text("utf-8")


def test_a_path_without_a_program_has_no_lines(tmp_path: Path) -> None:
    path = feedplan.Path.from_bezier([[0, 0], [10, 0], [10, 10]], axes=("X", "Y"))
    feedplan.write_plan(feedplan.plan(path, "mill"), tmp_path, formats=[])
    slowest = (tmp_path / "report.html").read_text(encoding="utf-8").split("Slowest lines")[1]
    assert '<tr><td class="n">–</td>' in slowest


def test_source_lines_are_those_of_the_reader_and_curves_have_none(tmp_path: Path) -> None:
    def slowest(name: str, content: bytes) -> str:
        (tmp_path / name).write_bytes(content)
        feedplan.write_plan(feedplan.plan(tmp_path / name, "mill"), tmp_path / "out", formats=[])
        return (tmp_path / "out" / "report.html").read_text(encoding="utf-8").split("Slowest lines")[1]

    for end in (b"\n", b"\r\n", b"\r"):
        lines = (b"G21 G90", b"", b"G1 X10 F6000", b"M2", b"")
        row = '<td class="n">3</td><td class="code"><code>G1 X10 F6000</code></td>'
        assert row in slowest("part.ngc", end.join(lines))
    # Curves are numbered, but their numbers are no lines of the file.
    curves = b'{"feed": 80,\n"curves": [\n{"degree": 1, "control_points": [[0, 0], [10, 0]]}]}\n'
    told = slowest("curves.json", curves)
    assert '<td class="n">1</td>' in told
    assert "feed&quot;: 80" not in told


def test_the_page_of_a_million_setpoints_stays_small(square: Any) -> None:
    figures = SetpointFigures(square.problem, ToolPath(square.problem), 1_000_000)
    random = np.random.default_rng(5)
    chunk = square.chunk
    for first in range(0, 1_000_000, 50_000):
        tables = [random.normal(size=(50_000, 3)) for _ in range(4)]
        t = (first + np.arange(50_000)) * 1e-3
        piece, u = np.zeros(50_000, np.uint32), np.zeros(50_000)
        figures.add(type(chunk)(t, *tables, np.full(50_000, 3, np.int32), chunk.axes, piece, u))
    path = figures.path.data(square.account.activity)
    assert len(contained({"time": figures.over_time(), "path": path})) < 5_000_000
    assert len(path["x"]) <= 60_000


def test_arrays_are_numbers_of_32_or_8_bits_at_multiples_of_4_bytes() -> None:
    given = {
        "text": "ä</script>",
        "a": [np.array([1.5, -2.0]), {"b": np.array([7, -8])}],
        "c": np.array([255, 0, 3], np.uint8),
        "d": np.array([1e300]),
    }
    content = contained(given)
    data = unpacked(content)
    assert data["text"] == given["text"]
    assert (data["a"][0].dtype, data["a"][0].tolist()) == (np.float32, [1.5, -2.0])
    assert (data["a"][1]["b"].dtype, data["a"][1]["b"].tolist()) == (np.int32, [7, -8])
    assert (data["c"].dtype, data["c"].tolist()) == (np.uint8, [255, 0, 3])
    assert data["d"].tolist() == [np.inf]
    assert len(content) % 4 == 0


def test_rotary_axes_have_curves_but_are_not_on_the_tool_path(square: Any, tmp_path: Path) -> None:
    square.problem = replace(square.problem, path=replace(square.path, axes=("A", "Z", "C")))
    data = data_of(page(square, tmp_path / "report.html"))
    assert data["axes"] == ["A", "Z", "C"]
    assert len(data["time"]["velocity"]) == 3
    assert data["path"]["x"].max() == 0.0
    assert data["path"]["z"].max() == 20.0


def test_the_use_of_all_limits_is_drawn_where_jerk_is_judged(square: Any, tmp_path: Path) -> None:
    assert "jerk" not in data_of(page(square, tmp_path / "report.html"))["judged"]
    verdict = replace(square.verdict, checks=(replace(square.verdict.checks[0], name="jerk", axis="X"),))
    text = page(replace(square, verdict=verdict), tmp_path / "report.html")
    assert data_of(text)["judged"] == ["jerk"]
    assert '<section id="use-section" hidden>' in text
