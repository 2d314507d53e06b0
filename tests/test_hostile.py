"""Files that are damaged or malicious give one short sentence, in bounded memory."""

from __future__ import annotations

import contextlib
import io
import os
import re
import resource
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from feedplan import cli
from feedplan.errors import LONGEST
from tests.campaign import seeds
from tests.hostile import DRAWING, MACHINE, OF_CONTROLLERS, PATH_FILE, PROGRAM, mutated, mutated_archive

SEEDS = seeds(100)
SMALL = "G21 G90\nF1200\nG1 X1 Y0.5\nX2\nM2\n"
# Greatest allowed growth of memory for small files [bytes].
GROWTH = 1 << 29
WORDS = len("error: ")


def outcome(*arguments: str) -> str:
    """What is wrong with the exit code or the output of a command; empty if nothing is."""
    said, errors = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(errors):
        code = cli.main(list(arguments))
    text = errors.getvalue()
    if code == cli.DONE or (code == cli.BROKEN and not text):
        return ""
    lines = text.splitlines()
    good = code in (cli.BROKEN, cli.BAD_INPUT) and len(lines) == 1 and "standard output" not in text
    return "" if good and len(lines[0]) <= LONGEST + WORDS else f"{code}: {text[:1000]}"


def of_all(content: bytes, file: Path, run: Callable[[], str], change: Callable[[bytes, int], bytes]) -> None:
    """Runs a command on a file and on mutations of it; asserts right outcomes and bounded memory."""
    file.write_bytes(content)
    assert run() == ""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found = []
    for seed in range(SEEDS):
        file.write_bytes(change(content, seed))
        wrong = run()
        found += [f"seed {seed}: {wrong}"] if wrong else []
    assert found == []
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
    assert grown < GROWTH


def planned(program: Path, *options: str) -> Callable[[], str]:
    return lambda: outcome("plan", str(program), "--max-setpoints", "20000", "--quiet", *options)


@pytest.mark.parametrize(
    ("name", "content", "options"),
    [
        ("part.ngc", PROGRAM, ("--machine", "mill")),
        ("part.json", PATH_FILE, ("--machine", "mill")),
        ("part.dxf", DRAWING, ("--machine", "mill", "--feed", "20")),
    ],
)
def test_mutated_programs(name: str, content: bytes, options: tuple[str, ...], tmp_path: Path) -> None:
    if name.endswith(".dxf"):
        pytest.importorskip("ezdxf")
    file = tmp_path / name
    of_all(content, file, planned(file, *options), mutated)


def test_mutated_machines(tmp_path: Path) -> None:
    program, file = tmp_path / "part.ngc", tmp_path / "mine.toml"
    program.write_text(SMALL)
    of_all(MACHINE, file, planned(program, "--machine", str(file)), mutated)


@pytest.mark.parametrize("name", OF_CONTROLLERS)
def test_mutated_files_of_controllers(name: str, tmp_path: Path) -> None:
    file = tmp_path / name
    of_all(OF_CONTROLLERS[name], file, lambda: outcome("machines", "import", str(file)), mutated)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A plan's folder with setpoints as npz."""
    return _written(tmp_path, "npz")


def _written(place: Path, form: str) -> Path:
    program, folder = place / "part.ngc", place / "out"
    program.write_text(SMALL)
    own = ("--machine", "mill", "--output", str(folder), "--format", form, "--period", "0.02", "--quiet")
    assert cli.main(["plan", str(program), *own]) == cli.DONE
    return folder


def test_mutated_plans(folder: Path) -> None:
    file = folder / "plan.json"
    of_all(file.read_bytes(), file, lambda: outcome("check", str(folder)), mutated)


@pytest.mark.parametrize("form", ["npz", "npz-compressed", "csv", "json"])
def test_mutated_setpoints(form: str, tmp_path: Path) -> None:
    folder = _written(tmp_path, form)
    (file,) = folder.glob("setpoints.*")
    change = mutated_archive if form.startswith("npz") else mutated
    of_all(file.read_bytes(), file, lambda: outcome("check", str(folder)), change)


# The cases from here on were found by hand.

DEEP = 100_000


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * DEEP,
        "a" + ".a" * 50_000 + " = 1",
        "[" + "a." * 50_000 + "a]",
        "period = 1" + "0" * 400,
        "period = 1" + "0" * 100_000,
        "name = 1" + "0" * 100_000,
        "".join(f"[[axes]]\nname = 'X{i}'\nmax_velocity = 1\nmax_acceleration = 1\n" for i in range(20_000)),
        f"name = '{'a' * 10_000_000}'",
    ],
    ids=[
        "brackets",
        "dots",
        "dots of a table",
        "400 digits",
        "100 000 digits",
        "name",
        "axes",
        "megabytes",
    ],
)
def test_machine_files(text: str, tmp_path: Path) -> None:
    program, file = tmp_path / "part.ngc", tmp_path / "mine.toml"
    program.write_text(SMALL)
    file.write_text(text)
    code, error = _alone("plan", str(program), "--machine", str(file))
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)


@pytest.mark.parametrize(
    "limits",
    ["velocity 1e-30", "acceleration 1e30", "acceleration 1e300", "chord 1e-300", "period 1e12"],
)
def test_numbers_of_machines_have_ranges(limits: str, tmp_path: Path) -> None:
    key, value = limits.split()
    names = {"acceleration": b"max_acceleration = 2000.0", "chord": b"chord_tolerance = 0.01"}
    old = names.get(key, b"period = 0.001" if key == "period" else b"max_velocity = 200.0")
    program, file = tmp_path / "part.ngc", tmp_path / "mine.toml"
    program.write_text(SMALL)
    file.write_bytes(MACHINE.replace(old, old.split(b"=")[0] + b"= " + value.encode()))
    code, error = _alone("plan", str(program), "--machine", str(file))
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)
    assert "give a number from" in error


INI = "[TRAJ]\nLINEAR_UNITS = mm\n"


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.ini", INI + "#INCLUDE a.ini\n", "a.ini includes itself"),
        ("a.cfg", "[printer]\n[include *.cfg]\n", "a.cfg includes itself"),
        ("a.ini", INI + "#INCLUDE b.inc\n" * 200, "includes more than 100 files"),
        ("a.ini", INI + "#INCLUDE pipe\n", "no velocity or acceleration"),
        ("a.ini", INI + "#INCLUDE ~nobody_at_all/none\n", "cannot be included"),
        ("a.ini", INI + "#INCLUDE " + "a" * 4000 + "\n", "cannot be included"),
        ("a.ini", INI + "\n" * 2_000_000, "more than 1048576 bytes"),
        ("a.ini", INI + "\n" * 1_000_000, "no velocity or acceleration"),
        ("a.ini", INI + f"[AXIS_X]\nMAX_VELOCITY = {'9' * 4000}\n", "no velocity"),
        ("a.ini", INI + (" " * 4000 + "x\n") * 250, "no velocity or acceleration"),
        ("a.ini", INI + "A = \\\n" * 150_000, "no velocity or acceleration"),
        ("a.cfg", "[printer]\n" + ("a" + " " * 4000 + "\n") * 250, "names no [printer] kinematics"),
        ("a.txt", "$110=1\n" + "> \n" * 300_000, "no acceleration of X"),
        ("a.txt", "".join(f"$1{k}0=1\n" for k in "123") + f"$20={'9' * 400}\n", "give a whole number"),
        (
            "a.yaml",
            "joint_limits:\n" + "".join(" " * k + "a:\n" for k in range(1, 1000)),
            "more than 20 levels",
        ),
        ("a.yaml", "joint_limits:\n" + "".join(f"  j{k}:\n" for k in range(50_000)), "no velocity"),
        ("a.yaml", "joint_limits: &a\n  b: [*a]\n", "no joints below joint_limits"),
    ],
)
def test_files_of_controllers(name: str, text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_text(text)
    (tmp_path / "b.inc").write_text("[AXIS_Q]\n")
    os.mkfifo(tmp_path / "pipe")
    code, error = _alone("machines", "import", str(file))
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)
    assert words in error


def test_files_that_include_each_other_deep_down(tmp_path: Path) -> None:
    for k in range(40):
        (tmp_path / f"{k}.ini").write_text(f"[EMC]\n#INCLUDE {k + 1}.ini\n")
    code, error = _alone("machines", "import", str(tmp_path / "0.ini"))
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)
    assert "15.ini line 2: files include each other more than 16 deep" in error


@pytest.mark.parametrize("content", ["[" * DEEP, '{"format":' * DEEP, f'{{"format": {"1" * 5000}}}'])
def test_plan_files(content: str, folder: Path) -> None:
    (folder / "plan.json").write_text(content)
    code, error = _alone("check", str(folder))
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)


def test_a_plan_with_a_time_of_400_digits(folder: Path) -> None:
    file = folder / "plan.json"
    file.write_text(re.sub(r'"time": [0-9.]+', f'"time": {"9" * 400}', file.read_text(), count=1))
    code, error = _alone("check", str(folder))
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)


def test_a_zip_bomb(tmp_path: Path) -> None:
    file, size = tmp_path / "setpoints.npz", 10_000_000
    header, stream = io.BytesIO(), io.BytesIO()
    shape = {"descr": "<f8", "fortran_order": False, "shape": (400_000_000,)}
    np.lib.format.write_array_header_1_0(header, shape)
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("t.npy", header.getvalue() + bytes(size))
    sizes = (struct.pack("<I", header.tell() + own) for own in (size, 3_200_000_000))
    file.write_bytes(stream.getvalue().replace(*sizes))
    code, error = _alone("check", str(file), "--machine", "mill")
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)
    assert "claim" in error


def test_an_output_of_a_name_too_long(tmp_path: Path) -> None:
    program = tmp_path / "part.ngc"
    program.write_text(SMALL)
    code, error = _alone("plan", str(program), "--output", str(tmp_path / ("a" * 300)))
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)
    assert "choose another folder" in error


@pytest.mark.parametrize("command", ["plan", "check", "fit"])
def test_an_input_of_a_name_too_long(command: str) -> None:
    code, error = _alone(command, "a" * 300)
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)
    assert "cannot be read (File name too long): give " in error


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
def test_a_full_standard_output(tmp_path: Path) -> None:
    program = tmp_path / "part.ngc"
    program.write_text(SMALL)
    with open("/dev/full", "w") as full:
        code, error = _alone("plan", str(program), "--json", stdout=full)
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)
    assert "no space left" in error


def test_more_setpoints_than_asked_for(tmp_path: Path) -> None:
    program = tmp_path / "part.ngc"
    program.write_text("G21 G90\nG1 X500 F0.05\nM2\n")
    code, error = _alone("plan", str(program))
    assert code == cli.BAD_INPUT, error
    _is_a_sentence(error)
    assert "--max-setpoints" in error


def _is_a_sentence(error: str) -> None:
    assert error.startswith("error: "), error[:2000]
    assert error.count("\n") == 1, error[:2000]
    assert len(error.strip()) <= LONGEST + WORDS


def _alone(*arguments: str, stdout: object = subprocess.DEVNULL) -> tuple[int, str]:
    """Exit code and error output of a command that runs in a process with little memory."""
    code = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_AS, (3 << 30, 3 << 30));"
        "from feedplan.cli import main; sys.exit(main(sys.argv[1:]))"
    )
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        stdout=stdout,  # type: ignore[call-overload]
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        check=False,
    )
    return done.returncode, done.stderr
