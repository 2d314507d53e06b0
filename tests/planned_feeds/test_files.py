"""The program with planned feeds in a file, in the folder of a plan, and on the command line."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any

import pytest

import feedplan
from feedplan.cli import main
from feedplan.errors import InputError
from tests.planned_feeds.programs import SQUARE, planned


@pytest.fixture
def part(tmp_path: Path) -> Path:
    file = tmp_path / "part.ngc"
    file.write_text(SQUARE)
    return file


def test_the_file_is_written_whole(part: Path, tmp_path: Path) -> None:
    result = feedplan.write_program(planned(SQUARE), tmp_path / "out.ngc")
    assert (tmp_path / "out.ngc").read_bytes() == result.content
    assert sorted(file.name for file in tmp_path.iterdir()) == ["out.ngc", "part.ngc"]
    with pytest.raises(InputError, match=r"cannot be written .*: choose another file"):
        feedplan.write_program(planned(SQUARE), tmp_path / "none" / "out.ngc")


def test_a_folder_tells_the_hash_of_its_program(part: Path, tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / "out"
    assert main(["plan", str(part), "-o", str(out), "--program"]) == 0
    summary = json.loads((out / "plan.json").read_text())
    content = (out / "program.ngc").read_bytes()
    told = summary["planned_program"]
    assert told["file"] == "program.ngc"
    assert told["sha256"] == hashlib.sha256(content).hexdigest()
    assert told["changed"] == 4
    text = capsys.readouterr().out
    assert "4 lines of 12 with another F, 0 split, 0 left as they were" in text
    assert "line 6: F60000 -> F" in text
    assert main(["check", str(out)]) == 0
    (out / "program.ngc").write_bytes(content + b"\n")
    assert main(["check", str(out)]) == 2
    assert "program.ngc was changed" in capsys.readouterr().err
    (out / "program.ngc").unlink()
    assert main(["check", str(out)]) == 2
    assert "program.ngc cannot be read" in capsys.readouterr().err


def test_a_program_is_not_written_over_itself(part: Path, tmp_path: Path, capsys: Any) -> None:
    before = part.read_bytes()
    lost = "is the program itself, which would be lost: choose another file"
    (tmp_path / "link.ngc").symlink_to(part)
    for place in ("part.ngc", "link.ngc"):
        assert main(["plan", str(part), "--program-out", str(tmp_path / place)]) == 2
        assert capsys.readouterr() == ("", f"error: {tmp_path / place} {lost}\n")
    own = part.rename(tmp_path / "program.ngc")
    assert main(["plan", str(own), "-o", str(tmp_path), "--program", "-q"]) == 2
    assert capsys.readouterr().err == f"error: {own} {lost}\n"
    assert own.read_bytes() == before
    assert sorted(file.name for file in tmp_path.iterdir()) == ["link.ngc", "program.ngc"]
    assert main(["plan", str(own), "-o", str(tmp_path), "-q"]) == 0
    assert main(["plan", str(own), "--program-out", ".", "-q"]) == 2
    assert capsys.readouterr().err == "error: . cannot be written (is a directory): choose another file\n"


def test_files_that_were_read_are_not_written_over(part: Path, tmp_path: Path, capsys: Any) -> None:
    machine, table = tmp_path / "own.toml", tmp_path / "tools.tbl"
    assert main(["machines", "new", "-o", str(machine)]) == 0
    table.write_text("T1 P1 D5 Z-20\n")
    before = [file.read_bytes() for file in (machine, table)]
    read = ["-m", str(machine), "--tool-table", str(table)]
    for file, what in ((machine, "machine file"), (table, "tool table")):
        capsys.readouterr()
        assert main(["plan", str(part), *read, "--program-out", str(file)]) == 2
        told = f"error: {file} is the {what} itself, which would be lost: choose another file\n"
        assert capsys.readouterr() == ("", told)
    assert [file.read_bytes() for file in (machine, table)] == before


@pytest.mark.parametrize("command", ["compare", "batch"])
def test_a_path_file_is_not_written_over_by_tables(command: str, tmp_path: Path, capsys: Any) -> None:
    own = tmp_path / ("comparison.json" if command == "compare" else "batch.json")
    own.write_text('{"unit": "mm", "feed": 9, "curves": [{"degree": 1, "control_points": [[0, 0], [5, 0]]}]}')
    before = own.read_bytes()
    methods = ["--methods", "bang-bang"] if command == "compare" else []
    assert main([command, str(own), *methods, "-o", str(tmp_path)]) == 2
    assert "is the program itself, which would be lost" in capsys.readouterr().err
    assert own.read_bytes() == before


def test_a_device_stays_and_a_link_leads_to_the_file(part: Path, tmp_path: Path) -> None:
    device, place, link = tmp_path / "pipe", tmp_path / "out.ngc", tmp_path / "link.ngc"
    os.mkfifo(device)
    place.write_text("before")
    link.symlink_to(place)
    reader = os.open(device, os.O_RDONLY | os.O_NONBLOCK)
    try:
        result = feedplan.write_program(feedplan.plan(part, "mill"), device)
        assert os.read(reader, 1 << 16) == result.content
    finally:
        os.close(reader)
    assert device.is_fifo()
    result.write(link)
    assert link.is_symlink()
    assert place.read_bytes() == result.content
    ring = tmp_path / "ring.ngc"
    ring.symlink_to(ring)
    with pytest.raises(InputError, match=r"ring\.ngc cannot be written \(.*\): choose another file"):
        result.write(ring)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["plan", "-o", ""], "'-o': it is empty: give a path"),
        (["compare", "-o", ""], "'-o': it is empty: give a path"),
        (["batch", "-o", ""], "'-o': it is empty: give a path"),
        (["plan", "--program-out", ""], "'--program-out': it is empty: give a path"),
        (["plan", "--program-out", "-"], "use feedplan filter, which writes the program there"),
    ],
)
def test_a_place_without_a_name_is_refused(
    arguments: list[str], told: str, part: Path, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([arguments[0], str(part), *arguments[1:]]) == 2
    printed, error = capsys.readouterr()
    assert (printed, list(tmp_path.iterdir())) == ("", [part])
    assert told in error
    with pytest.raises(InputError, match="the folder is '': give the path of a folder"):
        feedplan.write_plan(feedplan.plan(part, "mill"), "")
    with pytest.raises(InputError, match="the program is '': give the path of a file"):
        feedplan.read_program("")


def test_a_path_file_is_not_written_over_itself(tmp_path: Path) -> None:
    own = tmp_path / "plan.json"
    own.write_text('{"unit": "mm", "feed": 9, "curves": [{"degree": 1, "control_points": [[0, 0], [5, 0]]}]}')
    with pytest.raises(InputError, match=r"plan\.json is the program itself"):
        feedplan.write_plan(feedplan.plan(own, "mill"), tmp_path)


def test_a_program_of_an_earlier_plan_is_told(part: Path, tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / "out"
    assert main(["plan", str(part), "-o", str(out), "--program", "--format", "none", "-q"]) == 0
    assert main(["plan", str(part), "-o", str(out), "--format", "none"]) == 0
    assert "program.ngc is of an earlier plan" in capsys.readouterr().err


def test_the_command_writes_a_file_and_says_what_a_control_lacks(
    part: Path, tmp_path: Path, capsys: Any
) -> None:
    part.write_text(SQUARE.replace("G21", "G21 G64 P0.01"))
    file = tmp_path / "planned.nc"
    options = ["--program-out", str(file), "--dialect", "grbl", "--feed-step", "100", "--json"]
    assert main(["plan", str(part), *options]) == 0
    told = json.loads(capsys.readouterr().out)["planned_program"]
    assert told["split"] == 4
    assert told["notes"] == ["line 3: grbl lacks G64 and G61.1 (G64, 1 in all)"]
    assert feedplan.read_program(file, "mill").target[-1].tolist() == [0.0, 0.0, 5.0]


def test_options_that_belong_together_are_asked_for(part: Path, capsys: Any) -> None:
    assert main(["plan", str(part), "--program"]) == 2
    assert "--program needs a folder to write to" in capsys.readouterr().err
    assert main(["plan", str(part), "--feed-step", "10"]) == 2
    assert "give --program-out FILE as well" in capsys.readouterr().err
    assert main(["plan", str(part), "--program-out", "x", "--feed-step", "-1"]) == 2
    assert "--feed-step is -1 mm/s" in capsys.readouterr().err


def test_only_a_planned_program_is_written_beside_a_plan(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"the program is 'x': give what feedplan.planned_program returns"):
        feedplan.write_plan(planned(SQUARE), tmp_path / "out", (), program="x")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "options", [("--dialect", "grbl"), ("--feed-step", "0"), ("--expand",), ("--inverse-time",)]
)
def test_options_of_a_program_that_is_not_asked_for_are_refused(
    options: tuple[str, ...], part: Path, capsys: Any
) -> None:
    assert main(["plan", str(part), *options]) == 2
    assert (
        "are for the program with planned feeds: give --program-out FILE as well" in capsys.readouterr().err
    )
