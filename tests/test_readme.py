"""The commands and the code in README.md run unchanged, with the program and the machine from `examples/`."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

from feedplan.cli import main
from feedplan.machine.machine import Machine

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text("utf-8")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with copies of the program and the machine, as README.md tells the reader to make."""
    for name in ("part.ngc", "mine.toml"):
        shutil.copy(ROOT / "examples" / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def section(title: str, language: str) -> str:
    """The first code block in a language under a heading of README.md."""
    text = README.split(f"\n## {title}", 1)[1].split("\n## ", 1)[0]
    return text.split(f"```{language}\n", 1)[1].split("```", 1)[0]


def test_the_first_commands(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = section("Your first plan", "").splitlines()
    commands = [line for line in lines if line.startswith(".venv/bin/feedplan")]
    assert len(commands) >= 6
    said = {}
    for command in commands:
        code = main(shlex.split(command, comments=True)[1:])
        said[command] = capsys.readouterr().out
        assert code == 0, (command, said[command])
    first = next(command for command in commands if " plan " in command)
    assert f"time         {first.split('report.html: ')[1]} (" in said[first]


def test_the_gain_of_a_greater_feed_in_the_documentation(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (ROOT / "docs" / "machines.md").read_text("utf-8")
    command = next(line for line in text.splitlines() if line.endswith("--one-step-more"))
    assert main(shlex.split(command)[1:]) == 0
    gain = re.search(r"^feed × 1.2 +[0-9.]+ s less$", capsys.readouterr().out, re.MULTILINE)
    assert gain is not None
    assert f"`{' '.join(gain[0].split()[:3])}   {' '.join(gain[0].split()[3:])}`" in text


def test_the_first_lines_of_python(folder: Path) -> None:
    exec(compile(section("Your first plan", "python"), "README.md", "exec"), {})


def test_the_machine_file_is_that_of_the_examples(folder: Path) -> None:
    shown = section("Your first plan", "toml")
    (folder / "shown.toml").write_text(shown)
    shown_machine, own = Machine.load("shown.toml"), Machine.load("mine.toml")
    assert shown_machine.axes == own.axes[:1]
    assert (shown_machine.period, shown_machine.chord_tolerance) == (own.period, own.chord_tolerance)
