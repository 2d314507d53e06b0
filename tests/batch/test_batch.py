"""Batches in processes of this computer: folders, rows, continuing a stopped batch, errors."""

from __future__ import annotations

import csv
import json
import signal
from pathlib import Path

import pytest

import feedplan
from feedplan.batch.journal import Journal
from feedplan.batch.names import LONGEST, Names, safe_name
from feedplan.batch.packing import Packing
from feedplan.cli import main
from feedplan.errors import InputError
from feedplan.jobs.outcome import Outcome
from tests.batch.batches import PART, content, end, rows, run, start, wait_for, write
from tests.service.servers import long_part


def test_a_sweep_has_a_folder_and_a_row_for_each_plan(tmp_path: Path) -> None:
    [program] = write(tmp_path, 1)
    program.write_text(PART + "(end)\n")
    bad = tmp_path / "bad.ngc"
    bad.write_text("G1 Xq\nM2\n")
    missing = tmp_path / "missing.ngc"
    out = tmp_path / "out"
    sweep = ("--tolerance", "0.01", "--tolerance", "0.05", "-m", "mill", "-m", "router", "--format", "csv")
    done = run(program, bad, missing, *sweep, "-o", out)
    assert done.code == 1
    assert done.told.count("bad-mill-0.01: bad.ngc line 1: word Xq is not understood") == 1
    found = rows(out)
    assert [row["folder"] for row in found] == [
        f"{name}-{machine}-{tolerance}"
        for name in ("part0", "bad", "missing")
        for machine in ("mill", "router")
        for tolerance in ("0.01", "0.05")
    ]
    assert [row["ok"] for row in found] == [True] * 4 + [None] * 8
    assert {row["kind"] for row in found[4:]} == {"program"}
    assert "missing.ngc cannot be read (No such file" in found[-1]["error"]
    for row in found[:4]:
        made = feedplan.plan(program, row["machine"], tolerance=row["tolerance"])
        assert (row["time"], row["lower_bound"], row["gap"]) == (made.time, made.lower_bound, made.gap)
        assert {file.name for file in (out / row["folder"]).iterdir()} == {
            "plan.json",
            "setpoints.csv",
            "report.html",
        }
    assert sorted(place.name for place in out.iterdir()) == sorted(
        [*(row["folder"] for row in found[:4]), "batch.csv", "batch.json", "batch.jsonl"]
    )
    with (out / "batch.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert [row["folder"] for row in table] == [row["folder"] for row in found]
    assert float(table[0]["time"]) == found[0]["time"]
    assert "12 plans in " in done.said


def test_warnings_are_told_with_the_folder_of_their_plan(tmp_path: Path) -> None:
    [program] = write(tmp_path, 1)
    program.write_text("G1 X10 F100\nM2\n")
    warning = "part0: warning: the program gives no units (G20 or G21): millimetres are assumed\n"
    for _ in ("planned", "kept"):
        assert run(program, "-o", tmp_path / "out", "--format", "none").told.count(warning) == 1


def test_a_folder_is_what_plan_writes(tmp_path: Path) -> None:
    [program] = write(tmp_path, 1)
    code = main(["plan", str(program), "-q", "-o", str(tmp_path / "alone")])
    assert code == 0
    done = run(program, "-o", tmp_path / "out", "--json", "--jobs", "1")
    assert (done.code, done.told) == (0, "")
    assert json.loads(done.said)["rows"] == rows(tmp_path / "out")
    assert content(tmp_path / "out" / "part0") == content(tmp_path / "alone")


def test_programs_find_the_files_that_they_call_and_their_tools(tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    (tmp_path / "more").mkdir()
    program = tmp_path / "own" / "caller.ngc"
    program.write_text("G21 G90 F600 T1 M6 G43 H1\nO<pocket> call\nM98 P100\nG1 Z1\nM2\n")
    (tmp_path / "own" / "pocket.ngc").write_text("O<pocket> sub\nG1 X5\nO<pocket> endsub\nM2\n")
    (tmp_path / "more" / "o0100.nc").write_text("O0100\nG1 Y7\nM99\n")
    table = tmp_path / "tools.tbl"
    table.write_text("T1 P1 Z50 D6\n")
    options = ("--tool-table", str(table), "--subprograms", str(tmp_path / "more"))
    assert main(["plan", str(program), "-q", "-o", str(tmp_path / "alone"), *options]) == 0
    assert run(program, "-o", tmp_path / "out", *options).code == 0
    assert content(tmp_path / "out" / "caller") == content(tmp_path / "alone")


def test_a_stopped_batch_continues(tmp_path: Path) -> None:
    programs = write(tmp_path / "in", 3)
    out = tmp_path / "out"
    (tmp_path / "in" / "part2.ngc").write_text("G1 Xq\nM2\n")
    assert run(*programs, "-o", out).code == 1
    first = {row["folder"]: (out / row["folder"] / "plan.json").stat().st_mtime_ns for row in rows(out)[:2]}
    # One program is corrected, another one changed, and the last line of the journal is incomplete.
    programs[2].write_text(PART)
    programs[1].write_text(PART.replace("X10", "X7"))
    with (out / "batch.jsonl").open("a") as journal:
        journal.write('{"folder": "part0", "finger')
    (out / ".feedplan-left").mkdir()
    done = run(*programs, "-o", out)
    assert done.code == 0
    assert "3 plans in " in done.said
    assert ", 1 of them before" in done.said
    again = {name: (out / name / "plan.json").stat().st_mtime_ns for name in first}
    assert again["part0"] == first["part0"]
    assert again["part1"] > first["part1"]
    assert not (out / ".feedplan-left").exists()
    assert ", 3 of them before" in run(*programs, "-o", out).said
    # Another option gives another plan; if that fails, the folder of the earlier plan is removed.
    assert "before" not in run(*programs, "-o", out, "--feed", "10").said
    programs[0].write_text("G1 Xq\nM2\n")
    assert run(*programs, "-o", out).code == 1
    assert not (out / "part0").exists()
    assert (out / "part1").exists()


def test_files_that_are_gone_are_made_again_and_those_of_an_earlier_plan_are_told(tmp_path: Path) -> None:
    [program] = write(tmp_path, 1)
    out, made = tmp_path / "out", tmp_path / "out" / "part0" / "setpoints.npz"
    assert run(program, "-o", out).code == 0
    made.unlink()
    assert "before" not in run(program, "-o", out).said
    assert made.exists()
    told = "part0: warning: setpoints.npz is of an earlier plan\n"
    assert told in run(program, "-o", out, "--format", "csv").told


def test_an_interrupt_ends_a_batch_and_leaves_whole_folders_alone(tmp_path: Path) -> None:
    short, out = write(tmp_path, 1), tmp_path / "out"
    long = tmp_path / "long.ngc"
    long.write_bytes(long_part())
    options = ("--method", "jerk-limited", "--accuracy", "1e-5", "--jobs", "2", "-o", out)
    process = start(*short, long, *options)
    wait_for(lambda: (out / "part0").exists())
    process.send_signal(signal.SIGINT)
    done = end(process)
    assert (done.code, done.said) == (130, "")
    assert done.told.endswith("error: interrupted\n")
    wait_for(lambda: sorted(place.name for place in out.iterdir()) == ["batch.jsonl", "part0"])
    assert feedplan.check(out / "part0").ok


def test_limits_of_time_and_memory_end_one_plan_and_not_the_others(tmp_path: Path) -> None:
    long = tmp_path / "long.ngc"
    long.write_bytes(long_part())
    short = tmp_path / "short.ngc"
    short.write_text("G21 G90 F600\nG1 X10\nM2\n")
    programs = [long, short, tmp_path / "missing.ngc"]
    options = ("--method", "jerk-limited", "--accuracy", "1e-5", "-o", tmp_path / "out")
    done = run(*programs, *options, "--max-time", "1")
    assert done.code == 1
    assert [row["kind"] for row in rows(tmp_path / "out")] == ["limit", None, "program"]
    assert "long: the job has run for 1 s, all of max_time: choose a quicker method" in done.told
    run(short, *options, "--max-memory", "20", "--feed", "5")
    assert "max_memory: split the program" in rows(tmp_path / "out")[0]["error"]


def test_one_batch_at_a_time_works_on_a_folder(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    with pytest.raises(InputError, match=r"another batch works on .*: choose another folder with -o"):
        Journal(tmp_path)
    journal.close()
    Journal(tmp_path).close()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ("--method", "bang-bang", "--accuracy", "0.1"),
            "the method bang-bang takes no accuracy: leave it ",
        ),
        (
            ("--format", "npz", "--format", "npz-compressed"),
            "npz and npz-compressed are both setpoints.npz: ask for one of them",
        ),
        (("--format", "npz", "--format", "none"), "--format none excludes other formats: leave one"),
        (("-m", "mil"), "machine"),
        (("--tool-table", "none.tbl"), "the tool table none.tbl cannot be read (No such file"),
        (
            ("--subprograms", "none"),
            "the folder none of subprograms cannot be read (No such file or directory)",
        ),
        (("--jobs", "2", "--cluster", "127.0.0.1:8786"), "--jobs is for processes of this computer"),
        (("--tls-ca", "ca.pem"), "are for a cluster: give --cluster too"),
        (("-o", "part0.ngc"), "is a file, not a folder: choose another folder with -o"),
    ],
)
def test_bad_usage_is_one_sentence_and_plans_nothing(
    options: tuple[str, ...],
    sentence: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path, 1)
    assert main(["batch", "part0.ngc", "-o", "out", *options]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("error: ")
    assert sentence in said.err
    assert not (tmp_path / "out").exists()


def test_names_are_readable_safe_and_unlike_each_other(tmp_path: Path) -> None:
    assert safe_name("part.ngc") == "part"
    assert safe_name("Gehäuse links (2).nc", ["mill", "0.01"]) == "Gehause_links_2-mill-0.01"
    for hostile in ("../../etc/passwd", "..", ".ngc", "-rf.nc", "a\nb.nc", "C:\\x.nc", "\udcff.nc", "con.nc"):
        name = safe_name(hostile)
        assert name
        assert name[0] not in ".-"
        assert "/" not in name
        assert name.isascii()
        assert name.lower() != "con"
    assert len(safe_name("x" * 300, ["mill", "jerk-limited"])) <= LONGEST
    names = Names(["batch.csv"])
    given = ["a", "A", "a-2", "a", "batch.csv", "b"]
    assert [names.own(name) for name in given] == ["a", "A-2", "a-2-2", "a-3", "batch.csv-2", "b"]


def test_hostile_and_equal_names_have_folders_of_their_own(tmp_path: Path) -> None:
    files = [tmp_path / "a" / "part.ngc", tmp_path / "b" / "part.ngc", tmp_path / "-o ..;$(x)\n.ngc"]
    for number, file in enumerate(files):
        file.parent.mkdir(exist_ok=True)
        file.write_text(PART.replace("X10", f"X{9 + number}"))
    done = run("-o", tmp_path / "out", "--", *files)
    assert done.code == 0
    assert [row["folder"] for row in rows(tmp_path / "out")] == ["part", "part-2", "o_.._x"]
    assert len({row["time"] for row in rows(tmp_path / "out")}) == 3


def test_a_program_that_is_given_twice_is_planned_once(tmp_path: Path) -> None:
    [program] = write(tmp_path, 1)
    done = run(program, tmp_path / "." / program.name, program, "-o", tmp_path / "out", "--format", "none")
    assert (done.code, [row["folder"] for row in rows(tmp_path / "out")]) == (0, ["part0"])


def test_small_jobs_are_packed_and_large_ones_are_not() -> None:
    packing = Packing()
    assert packing.count(1000, 2) == 1
    packing.add(Outcome("done", seconds=0.05, size=100_000))
    assert packing.count(1000, 2) == 10
    assert packing.count(8, 2) == 2, "all have work to the end"
    assert packing.count(1, 2) == 1
    for _ in range(100):
        packing.add(Outcome("done", seconds=0.001, size=100_000_000))
    assert packing.count(1000, 2) == 1
