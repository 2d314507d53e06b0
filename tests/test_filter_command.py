"""`feedplan filter` as LinuxCNC calls it: the program on standard output, progress on standard error."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.named import EXAMPLES
from feedplan.cli.filter import filter_progress
from feedplan.program.gcode import read_gcode

INI = """[KINS]
KINEMATICS = trivkins
[TRAJ]
COORDINATES = X Y Z
LINEAR_UNITS = mm
""" + "".join(
    f"[AXIS_{name}]\nMAX_VELOCITY = 8\nMAX_ACCELERATION = 50\nMIN_LIMIT = -1\nMAX_LIMIT = 0\n"
    for name in "XYZ"
)


def run(*arguments: str, **environment: str) -> tuple[int, bytes, str]:
    # Without standard input, as LinuxCNC's AXIS starts it.
    done = subprocess.run(
        [sys.executable, "-m", "feedplan", "filter", *arguments],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        env={**os.environ, **environment},
        check=False,
    )
    return done.returncode, done.stdout, done.stderr.decode()


def test_progress_rises_from_0_to_100_in_lines_that_linuxcnc_reads() -> None:
    code, out, error = run(str(EXAMPLES / "part.ngc"), "--machine", "mill")
    assert code == 0
    told = [int(match[1]) for match in re.finditer(r"^FILTER_PROGRESS=(\d+)$", error, re.MULTILINE)]
    assert len(told) == error.count("\n") - error.count("warning: ")
    assert told == sorted(set(told))
    assert (told[0], told[-1]) == (0, 100)
    assert len(read_gcode(out)) == len(read_gcode(EXAMPLES / "part.ngc"))


def test_warnings_are_told_beside_the_progress(tmp_path: Path) -> None:
    file = tmp_path / "units.ngc"
    file.write_text("G1 X10 F100\nM2\n")
    code, _, error = run(str(file), "--machine", "mill")
    assert code == 0
    assert re.findall(r"^warning: .*$", error, re.MULTILINE) == [
        "warning: the program gives no units (G20 or G21): millimetres are assumed"
    ]


def test_the_machine_is_that_of_the_ini_file_without_its_travel(tmp_path: Path) -> None:
    file = tmp_path / "mill.ini"
    file.write_text(INI)
    code, out, error = run(str(EXAMPLES / "die.ngc"), INI_FILE_NAME=str(file))
    assert code == 0, error
    feeds = [float(feed) for feed in re.findall(rb"F([\d.]+)", out.split(b"M30")[0])]
    assert max(feeds) < 60 * 8 * 3**0.5 + 1
    file.write_text(INI.replace("MAX_ACCELERATION = 50\nMIN", "MIN"))
    code, out, error = run(str(EXAMPLES / "die.ngc"), INI_FILE_NAME=str(file))
    assert (code, out) == (2, b"")
    assert "has no acceleration of X, Y, Z" in error


def test_without_a_machine_and_an_ini_file_nothing_is_planned() -> None:
    code, out, error = run(str(EXAMPLES / "part.ngc"), INI_FILE_NAME="")
    assert (code, out) == (2, b"")
    assert error == (
        "error: LinuxCNC has named no INI file (INI_FILE_NAME): give the machine with --machine\n"
    )


@pytest.mark.parametrize("stages", [[("read", 0.5), ("fit", 1.0), ("plan", 2.0), ("write", 1.0)]])
def test_each_per_cent_is_reported_once(stages: list[tuple[str, float]]) -> None:
    lines: list[str] = []
    tell = filter_progress(lines.append)
    for stage, done in [*stages, *stages]:
        tell(stage, done)
    assert lines == [f"FILTER_PROGRESS={n}\n" for n in (5, 30, 70, 100)]
