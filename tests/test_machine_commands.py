"""`feedplan machines`: the list, one machine, a template, and machines from files of controllers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from feedplan import Machine
from feedplan.cli import main
from feedplan.machine.machine import bundled_machines, template

GRBL = "$110=6000\n$111=6000\n$112=600\n$120=250\n$121=200\n"


@pytest.fixture
def dump(tmp_path: Path) -> Path:
    file = tmp_path / "router.txt"
    file.write_text(GRBL)
    return file


def test_machines_lists_every_one_and_shows_each(capsys: Any) -> None:
    assert main(["machines"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == list(bundled_machines())
    assert main(["machines", "show", "tarus"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()[1:]]
    assert rows == [
        ["X", "mm", "170", "400", "4000", "-"],
        ["Y", "mm", "180", "600", "6000", "-"],
        ["Z", "mm", "240", "2000", "20000", "-"],
    ]
    assert main(["machines", "show", "cylindrical"]) == 0
    assert [line.split()[1] for line in capsys.readouterr().out.splitlines()[1:]] == ["deg", "mm", "mm"]


def test_limits_in_a_row_have_the_units_of_their_axes(capsys: Any) -> None:
    assert main(["machines"]) == 0
    rows = {line.split()[0]: " ".join(line.split()) for line in capsys.readouterr().out.splitlines()}
    assert rows["cylindrical"].startswith("cylindrical CXZ 170 deg 250 200 mm 1150 deg 2000 1000 mm")
    assert rows["mill"].startswith("mill XYZ 500 500 400 mm 3000")


def test_the_template_loads_unchanged_and_with_all_commented_lines(tmp_path: Path, capsys: Any) -> None:
    file = tmp_path / "mine.toml"
    assert main(["machines", "new", "-o", str(file)]) == 0
    assert capsys.readouterr().out == f"{file}\n"
    assert Machine.load(file).axis_names == ("X", "Y", "Z")
    assert file.read_text(encoding="utf-8") == template()
    assert main(["machines", "new"]) == 0
    assert capsys.readouterr().out == template()
    # The commented lines of the template are valid when the comment signs are removed.
    offered = [
        line.removeprefix("# ") if " = " in line or "[" in line[:5] else line
        for line in template().splitlines()
    ]
    text = "\n".join(offered).replace("home = [0.0, 0.0, 100.0]", "home = [0.0, 0.0, 100.0, 0.0]")
    file.write_text(text.replace("G54 = [0.0, 0.0, 0.0]", "G54 = [0.0, 0.0, 0.0, 0.0]"))
    machine = Machine.load(file)
    assert machine.axis_names == ("X", "Y", "Z", "A")
    assert (machine.chord_tolerance, machine.axis("X").travel) == (0.01, (-300.0, 300.0))


@pytest.mark.parametrize("name", bundled_machines())
def test_a_template_may_be_any_bundled_machine(name: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    assert main(["machines", "new", "--like", name, "-o", str(file)]) == 0
    assert Machine.load(file) == Machine.load(name)


def test_import_asks_for_all_that_the_file_lacks_and_takes_it(dump: Path, capsys: Any) -> None:
    assert main(["machines", "import", str(dump)]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert error.startswith(
        "error: router.txt (grbl) has no acceleration of Z: give each by --limit, as --limit Z.acc"
    )
    given = ["--limit", "Z.acceleration=50", "--limit", "X.jerk=5000"]
    assert main(["machines", "import", str(dump), *given, "--name", "mine"]) == 0
    out, error = capsys.readouterr()
    assert error == (
        "warning: router.txt (grbl) has no jerk of Y, Z: jerk-limited, s-curve and ruckig need it "
        "(--limit Y.jerk=...)\n"
    )
    file = dump.with_name("machine.toml")
    file.write_text(out, encoding="utf-8")
    machine = Machine.load(file)
    assert (machine.name, machine.axis("Z").max_acceleration, machine.axis("X").max_jerk) == (
        "mine",
        50,
        5000,
    )
    program = dump.with_name("part.ngc")
    program.write_text("G21 G90\nF1200\nG1 X10 Y5\nM2\n")
    assert main(["plan", str(program), "--machine", str(file), "-q"]) == 0


def test_a_file_that_there_is_stays(dump: Path, capsys: Any) -> None:
    file = dump.with_name("machine.toml")
    arguments = ["machines", "import", str(dump), "--limit", "Z.acceleration=50", "-o", str(file)]
    assert main(arguments) == 0
    before = file.read_text(encoding="utf-8")
    assert main([*arguments, "--limit", "X.velocity=1"]) == 2
    assert "is there already: choose another name with -o" in capsys.readouterr().err
    assert file.read_text(encoding="utf-8") == before
    assert sorted(entry.name for entry in dump.parent.iterdir()) == ["machine.toml", "router.txt"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["machines", "import"], "Missing argument 'FILE'"),
        (["machines", "import", "none.ini"], "none.ini cannot be read (No such file or directory): give "),
        (
            ["machines", "import", "DUMP", "--limit", "X.jerk"],
            "--limit 'X.jerk' is no limit: give one such as",
        ),
        (["machines", "import", "DUMP", "--limit", "X.jerk=fast"], "give one such as X.jerk=5000"),
        (["machines", "import", "DUMP", "--limit", "X.jerk=-1"], "the limit X.jerk is -1.0"),
        (["machines", "new", "--like", "toaster"], "there is no bundled machine 'toaster'"),
        (["machines", "toaster"], "No such command 'toaster'"),
    ],
)
def test_bad_usage_is_one_sentence(arguments: list[str], words: str, dump: Path, capsys: Any) -> None:
    assert main([str(dump) if word == "DUMP" else word for word in arguments]) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert words in error
    assert error.count("\n") == 1
