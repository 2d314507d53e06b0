"""The command line: results on standard output, all else on standard error, and exit codes."""

from __future__ import annotations

import importlib
import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from benchmarks.named import EXAMPLES
from feedplan.audit import Audit, LimitCheck
from feedplan.cli import main, terminal
from feedplan.errors import InfeasibleError, MissingPackageError, ProgramError, SolverError
from feedplan.machine.machine import Machine
from feedplan.outputs import KNOTS, format_named
from feedplan.report import tables
from tests.outputs.parquet import FORMATS
from tests.sentences import assert_one_sentence


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Replaces the planner by one that records its arguments and returns or raises `result`."""
    box: dict[str, Any] = {}

    def fake(program: str, machine: Any, **options: Any) -> Any:
        box.update(program=program, machine=machine, **options)
        if isinstance(box["result"], BaseException):
            raise box["result"]
        return box["result"]

    # This module binds the planner when it is first imported, so it is imported before.
    importlib.import_module("feedplan.one_step_more")
    monkeypatch.setattr("feedplan.planning.plan", fake)
    return box


def test_a_plan_prints_its_result_and_nothing_else(planned: Any, square: Any, capsys: Any) -> None:
    planned["result"] = square
    assert main(["plan", "a.ngc", "--machine", "router"]) == 0
    out, err = capsys.readouterr()
    rows = dict(line.split(None, 1) for line in out.splitlines() if not line.startswith("lower"))
    assert rows["time"] == "2.000 s"
    assert rows["length"] == "80.000 mm, mean 40 mm/s (2400 mm/min)"
    assert rows["audit"] == "passed, 2001 samples, nearest X acceleration 100.00 %"
    assert err == ""


def test_the_table_and_the_report_name_the_same_limit_as_the_nearest_one() -> None:
    values = (("acceleration", "X", 0.5), ("acceleration_jump", "Y", 0.95), ("duration", None, 1.0))
    checks = [LimitCheck(name, axis, ratio, 1.0, ratio, 0.1, 3, True) for name, axis, ratio in values]
    audit = Audit(tuple(checks), 100)
    assert terminal.audit_text(audit) == "passed, 100 samples, nearest Y acceleration jump 95.00 %"
    assert "Y acceleration step where the curvature jumps, 95.00 %" in tables.verdict(audit)


def test_all_options_reach_the_planner(planned: Any, square: Any) -> None:
    planned["result"] = square
    options = "--tolerance 0.02 --feed 80 --feed-override 1.5 --period 0.002 --start-speed 1 --end-speed 0"
    assert main(["plan", "a.ngc", "-m", "tarus", "--method", "bang-bang", *options.split()]) == 0
    assert planned["machine"].name == "tarus"
    names = ("program", "method", "tolerance", "feed", "feed_override", "period", "start_speed", "end_speed")
    assert [planned[name] for name in names] == ["a.ngc", "bang-bang", 0.02, 80, 1.5, 0.002, 1, 0]


def test_json_is_the_summary_and_warnings_go_to_the_other_stream(
    planned: Any, square: Any, capsys: Any
) -> None:
    square.warnings = ("line 3: slow",)
    planned["result"] = square
    assert main(["plan", "a.ngc", "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["time"] == 2.0
    assert err == "warning: line 3: slow\n"


def test_quiet_prints_nothing(planned: Any, square: Any, capsys: Any) -> None:
    square.warnings = ("line 3: slow",)
    planned["result"] = square
    assert main(["plan", "a.ngc", "-q"]) == 0
    assert capsys.readouterr() == ("", "")


def test_quiet_prints_the_json_that_is_asked_for(planned: Any, square: Any, capsys: Any) -> None:
    square.warnings = ("line 3: slow",)
    planned["result"] = square
    assert main(["plan", "a.ngc", "-q", "--json"]) == 0
    out, err = capsys.readouterr()
    assert json.loads(out)["time"] == 2.0
    assert err == ""


def test_a_name_given_twice_is_refused(program: Path, capsys: Any) -> None:
    twice = 2 * ["--controller-option", "junction_deviation=0.02"]
    assert main(["plan", str(program), "--controller", "grbl", *twice]) == 2
    assert "--controller-option has junction_deviation twice: give it once" in capsys.readouterr().err
    assert main(["machines", "import", "a.ini", "--limit", "X.jerk=1", "--limit", "X.jerk=2"]) == 2
    assert "--limit has X.jerk twice: give it once" in capsys.readouterr().err


def test_the_folder_is_written_and_named(planned: Any, square: Any, tmp_path: Path, capsys: Any) -> None:
    planned["result"] = square
    assert main(["plan", "a.ngc", "-o", str(tmp_path / "out"), "--format", "csv", "--format", "npz"]) == 0
    files = ["plan.json", "report.html", "setpoints.csv", "setpoints.npz"]
    assert sorted(entry.name for entry in (tmp_path / "out").iterdir()) == files
    assert str(tmp_path / "out" / "report.html") in capsys.readouterr().out


def test_a_step_without_a_folder_is_refused(planned: Any, square: Any, capsys: Any) -> None:
    planned["result"] = square
    assert main(["plan", "a.ngc", "--step", "0.01"]) == 2
    assert (
        "--step needs a folder to write to: give -o DIR and --format pvt as well" in capsys.readouterr().err
    )


def test_setpoints_of_an_earlier_plan_give_a_warning(
    planned: Any, square: Any, tmp_path: Path, capsys: Any
) -> None:
    planned["result"] = square
    assert main(["plan", "a.ngc", "-o", str(tmp_path), "--format", "csv"]) == 0
    assert main(["plan", "a.ngc", "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().err == f"warning: {tmp_path / 'setpoints.csv'} is of an earlier plan\n"


def test_a_broken_limit_is_written_reported_and_exits_1(
    planned: Any, broken_square: Any, tmp_path: Path, capsys: Any
) -> None:
    planned["result"] = broken_square
    assert main(["plan", "a.ngc", "-o", str(tmp_path)]) == 1
    out, err = capsys.readouterr()
    assert "FAILED, 1 of 2 limits broken" in out
    # A plan that breaks limits may be faster than the bound: it has no gap.
    assert " s for this path, which keeps the limits\n" in out
    assert err == f"error: the audit failed: {broken_square.verdict.failures[0]}\n"
    assert "Audit FAILED" in (tmp_path / "report.html").read_text()


@pytest.mark.parametrize(
    ("error", "code", "sentence"),
    [
        (InfeasibleError("line 4: no profile ends\nat 120 mm/s"), 1, "line 4: no profile ends at 120 mm/s"),
        (SolverError("gave up"), 1, "gave up"),
        (ProgramError("a.ngc, line 2: 'Q' is unknown", 2), 2, "a.ngc, line 2: 'Q' is unknown"),
        (MissingPackageError("pip install toppra"), 2, "pip install toppra"),
        (MemoryError(), 2, "the memory of this computer does not suffice: split the program"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_each_error_is_one_sentence_and_writes_nothing(
    error: BaseException, code: int, sentence: str, planned: Any, tmp_path: Path, capsys: Any
) -> None:
    planned["result"] = error
    assert main(["plan", "a.ngc", "-o", str(tmp_path / "out")]) == code
    out, err = capsys.readouterr()
    assert (out, err.strip()) == ("", f"error: {sentence}")
    assert list(tmp_path.iterdir()) == []


def test_a_defect_is_named_as_one_and_the_traceback_is_there_for_the_asking(
    planned: Any, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    planned["result"] = IndexError("7")
    monkeypatch.delenv("FEEDPLAN_TRACEBACK", raising=False)
    assert main(["plan", "a.ngc"]) == 70
    err = capsys.readouterr().err
    assert err.startswith("error: this is a defect in feedplan (IndexError: 7): please report it")
    assert "FEEDPLAN_TRACEBACK=1" in err
    monkeypatch.setenv("FEEDPLAN_TRACEBACK", "1")
    with pytest.raises(IndexError):
        main(["plan", "a.ngc"])


EXAMPLE = str(EXAMPLES / "part.ngc")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plan"], "Missing argument 'PROGRAM' (`feedplan plan --help` shows the usage)"),
        (["plan", "a", "b"], "unexpected extra argument"),
        (["plan", "a", "--feed", "nan"], "nan: give a number > 0"),
        (["plan", "a", "--feed", "0"], "0: give a number > 0"),
        (["plan", "a", "--start-speed", "-1"], "-1: give a number ≥ 0"),
        (["plan", "a", "--period", "soon"], "'soon' is not a number"),
        (["plan", "a", "--method", "magic"], "'magic' is not"),
        (["plan", "a", "--format", "xml"], "'xml' is not one of"),
        (["plan", "a", "--format", "csv"], "--format needs a folder"),
        (["plan", "a", "--machine", "toaster"], "there is no bundled machine 'toaster'"),
        (["plan", "a", "-o", __file__], "test_cli.py is a file, not a folder"),
        (["machines", "show", "toaster"], "there is no bundled machine 'toaster'"),
        (["plna"], "No such command 'plna'"),
        (
            ["plan", EXAMPLE, "--accuracy", "0.1"],
            "takes no accuracy: leave it out, or choose a method that takes it (casadi, clarabel, jerk-lim",
        ),
        (["plan", EXAMPLE, "--time-limit", "1"], "bang-bang takes no --time-limit: leave it out, or choose"),
        (["plan", EXAMPLE, "--max-setpoints", "9"], "or ask for so many by --max-setpoints"),
        (["plan", EXAMPLE, "--path-rounds", "2"], "--path-rounds is 2: give it with the path fastest"),
        (["fit", EXAMPLE, "--whole-step", "-1"], "--whole-step is -1: give a positive number"),
        (["plan", "/none/path_rounds.nc"], "error: /none/path_rounds.nc cannot be read"),
    ],
)
def test_bad_usage_is_one_sentence_and_exits_2(arguments: list[str], words: str, capsys: Any) -> None:
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert_one_sentence(err, words)


def test_a_word_of_a_program_is_no_option(tmp_path: Path, capsys: Any) -> None:
    file = tmp_path / "own.ngc"
    file.write_text("G21 F100\nG1 X[#<tool_table>]\nM2\n")
    assert main(["plan", str(file)]) == 2
    assert "parameter #<tool_table> is used" in capsys.readouterr().err


SQUARE = "G21 G90\nG61\nF3000\nG1 X20\nG1 Y20\nG1 X0\nG1 Y0\nM2\n"


@pytest.fixture
def program(tmp_path: Path) -> Path:
    file = tmp_path / "square.ngc"
    file.write_text(SQUARE)
    return file


def test_a_program_is_planned_and_its_folder_checked(program: Path, tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / "out"
    assert main(["plan", str(program), "-m", "router", "-o", str(out), "--json"]) == 0
    printed, warned = capsys.readouterr()
    summary = json.loads(printed)
    # Four sides of 20 mm at 50 mm/s and 500 mm/s², with a stop at every corner.
    assert summary["time"] == pytest.approx(2.0, abs=1e-9)
    assert summary["length"] == pytest.approx(80.0)
    assert summary["audit"]["ok"]
    assert summary["compute"]["sample"] > 0
    assert json.loads((out / "plan.json").read_text()) == summary
    assert warned == ""

    assert main(["check", str(out)]) == 0
    assert "X acceleration" in capsys.readouterr().out
    assert main(["check", str(out), "--machine", "mill", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ok"] is True
    assert main(["check", str(out / "setpoints.npz"), "--machine", "tarus"]) == 1
    out_text, err = capsys.readouterr()
    assert "BROKEN" in out_text
    assert err.startswith("error: the audit failed: ")


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_passes_the_check(name: str, program: Path, tmp_path: Path) -> None:
    output = format_named(name)
    step = ["--step", "0.01"] if output.ROWS == KNOTS else []
    options = ["-m", "router", "-o", str(tmp_path / name), "--format", name, *step, "-q"]
    assert main(["plan", str(program), *options]) == 0
    assert main(["check", str(tmp_path / name)]) == 0
    assert main(["check", str(tmp_path / name / output.FILE)]) == 0


def test_jerk_is_judged_where_the_method_of_the_plan_limits_it(
    program: Path, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = str(tmp_path / "out")
    assert main(["plan", str(program), "-m", "router", "-o", out, "-q"]) == 0
    assert main(["check", out]) == 0
    # Bang-bang does not limit jerk: if it claims to, the audit of the plan and of its setpoints fails.
    monkeypatch.setattr("feedplan.planners.bang_bang.LIMITS_JERK", True, raising=False)
    assert main(["check", out]) == 1
    assert " jerk " in capsys.readouterr().err
    assert main(["plan", str(program), "-m", "router", "-o", out, "-q"]) == 1
    assert " jerk " in capsys.readouterr().err


def test_a_check_without_a_machine_asks_for_one(program: Path, tmp_path: Path, capsys: Any) -> None:
    main(["plan", str(program), "-o", str(tmp_path / "out"), "-q"])
    (tmp_path / "out" / "plan.json").unlink()
    assert main(["check", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.endswith("names no machine: give the machine with --machine\n")


def test_fit_prints_splines_and_deviation(program: Path, capsys: Any) -> None:
    assert main(["fit", str(program)]) == 0
    assert "4 pieces in 4 runs" in capsys.readouterr().out
    assert main(["fit", str(program), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["pieces"] == 4


@pytest.mark.parametrize("command", ["plan", "compare", "time", "fit", "batch"])
def test_names_of_files_may_be_bytes_that_are_no_utf_8(
    command: str, program: Path, tmp_path: Path, capsys: Any
) -> None:
    odd = tmp_path / os.fsdecode(b"Geh\xe4use.nc")
    try:
        program.rename(odd)
    except OSError:
        pytest.skip("the file system has names in UTF-8 only")
    machine, out = tmp_path / os.fsdecode(b"Fr\xe4se.TOML"), tmp_path / "out"
    machine.write_text(Machine.load("mill").to_toml())
    options = {
        "compare": ["--methods", "bang-bang", "-o", str(out)],
        "plan": ["-o", str(out)],
        "batch": ["-o", str(out)],
    }
    assert main([command, str(odd), "-m", str(machine), "--json", *options.get(command, [])]) == 0
    said = capsys.readouterr()
    assert command == "fit" or "Geh\ufffduse.nc" in json.dumps(json.loads(said.out), ensure_ascii=False)
    assert main([command, str(odd), "-m", str(machine), *options.get(command, [])]) == 0


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00\x01\xff\xfe",
        b"G1 X",
        b"G1 Xnan\n",
        b"M2\n",
        b"(only a comment)\n",
        b"G1 X1e400 F100\n",
        None,
    ],
)
@pytest.mark.parametrize("command", ["plan", "fit"])
def test_a_file_that_is_no_program_is_one_sentence_and_writes_nothing(
    command: str, content: bytes | None, tmp_path: Path, capsys: Any
) -> None:
    file = tmp_path / "a.ngc"
    if content is not None:
        file.write_bytes(content)
    out = tmp_path / "out"
    assert main([command, str(file), *(["-o", str(out)] if command == "plan" else [])]) == 2
    printed, err = capsys.readouterr()
    assert printed == ""
    assert_one_sentence(err, "a.ngc")
    assert not out.exists()


def test_a_program_comes_from_standard_input_as_well(
    program: Path, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    printed = []
    for source in (str(program), "-"):
        text = program.read_bytes()
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BufferedReader(_Named(text))))
        assert main(["plan", source, "--json", "-o", str(tmp_path / "out")]) == 0
        printed.append(json.loads(capsys.readouterr().out))
        report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
        assert f"<code>{text.decode().splitlines()[3]}" in report
    assert printed[1]["program"] == "<stdin>"
    same = ("time", "program_sha256", "pieces", "slow_lines")
    assert [printed[0].get(name) for name in same] == [printed[1].get(name) for name in same]


@pytest.mark.parametrize("command", ["plan", "fit", "compare"])
def test_every_command_that_reads_a_program_reads_standard_input(command: str, program: Path) -> None:
    more = ["--methods", "bang-bang"] if command == "compare" else []
    done = run(command, "-", *more, input=program.read_text())
    assert (done.returncode, done.stderr) == (0, "")
    assert run(command, str(program), *more).stdout.splitlines()[1].split()[0] in done.stdout
    done = run(command, "-", *more, input="")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: <stdin> is empty: give a part program\n"
    done = run(command, "-", *more, input="G21 G1 F60 X1\nQ2\n")
    assert done.stderr.startswith("error: <stdin> line 2: word Q2")


def test_a_closed_standard_input_is_one_sentence() -> None:
    done = subprocess.run(
        ["sh", "-c", f"{sys.executable} -m feedplan plan - <&-"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "standard input is closed: give the path of a program" in done.stderr


class _Named(io.BytesIO):
    """Standard input with the content of a program."""

    name = "<stdin>"


def test_an_end_speed_out_of_reach_exits_1(program: Path, tmp_path: Path, capsys: Any) -> None:
    arguments = ["plan", str(program), "-m", "router", "--end-speed", "999", "-o", str(tmp_path / "out")]
    assert main(arguments) == 1
    assert "999" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_no_command_shows_the_help_and_exits_2(capsys: Any) -> None:
    assert main([]) == 2
    assert "Commands:" in capsys.readouterr().err


def test_help_and_version_exit_0(capsys: Any) -> None:
    assert main(["--help"]) == 0
    assert main(["plan", "-h"]) == 0
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith("feedplan ")


def test_the_package_runs_as_a_module() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "feedplan", "--version"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stdout.split()[0]) == (0, "feedplan")


def test_an_interrupt_during_the_imports_is_told_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "click.py").write_text("raise KeyboardInterrupt")
    done = subprocess.run(
        [sys.executable, "-m", "feedplan", "machines"],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted\n")


def test_a_token_needs_a_service(program: Path, tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "token").write_text("0123456789abcdef\n")
    assert main(["plan", str(program), "--token-file", str(tmp_path / "token")]) == 2
    assert "--token-file needs a service that asks for it: give --server URL" in capsys.readouterr().err


MAIN = "import sys; from feedplan.cli import main; sys.exit(main())"


def run(*arguments: str, **more: Any) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", MAIN, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, **more)


def test_a_terminal_without_unicode_gets_replacements() -> None:
    done = run("machines", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stderr) == (0, "")
    assert " /s? " in done.stdout


def test_a_closed_pipe_is_no_error() -> None:
    shell = f"{sys.executable} -c '{MAIN}' machines | true"
    done = subprocess.run(["sh", "-c", shell], capture_output=True, text=True, check=False)
    assert done.stderr == ""


@pytest.mark.parametrize("closed", ["stdout", "stderr"])
def test_a_closed_pipe_has_the_exit_code_of_one(closed: str, tmp_path: Path) -> None:
    (tmp_path / "part.ngc").write_text("G21\nG1 X5 F600\n")  # gives warnings on standard error
    reads, writes = os.pipe()
    os.close(reads)
    command = [sys.executable, "-c", MAIN, "plan", str(tmp_path / "part.ngc")]
    own = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, closed: writes}
    done = subprocess.run(command, text=True, check=False, **own)  # type: ignore[call-overload]
    os.close(writes)
    assert done.returncode == 141
    assert "error" not in f"{done.stdout}{done.stderr}"


def test_the_help_imports_no_slow_package() -> None:
    code = "import sys, feedplan.cli; print({'rich', 'scipy', 'toppra'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
