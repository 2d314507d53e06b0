"""Batches on a Dask cluster: equal files, loss of workers, safe connections."""

from __future__ import annotations

import logging
import shutil
import signal
import threading
import time
from pathlib import Path

import pytest

import feedplan
from feedplan.cli import main
from feedplan.errors import InputError
from feedplan.jobs import cluster_task
from feedplan.jobs.address import ClusterAddress
from feedplan.jobs.called import called_files
from feedplan.jobs.cluster import Cluster
from feedplan.jobs.cluster_runs import ClusterRuns
from feedplan.jobs.executor import JobLimits
from feedplan.jobs.order import Job, Order
from feedplan.jobs.work import Stopped
from tests.batch.batches import PART, content, end, rows, run, start, wait_for, write
from tests.clusters import DEADLY, LocalCluster, running
from tests.service.servers import long_part

LIMITS = JobLimits(60.0, 4000.0)
SLOW = ("--method", "jerk-limited", "--accuracy", "1e-5")


def long_program(folder: Path) -> Path:
    file = folder / "long.ngc"
    file.write_bytes(long_part())
    return file


def test_a_cluster_gives_the_files_of_this_computer(cluster: LocalCluster, tmp_path: Path) -> None:
    programs = write(tmp_path, 3)
    caller, bad = tmp_path / "caller.ngc", tmp_path / "bad.ngc"
    caller.write_text("G21 G90 F600 T1 M6 G43 H1\nO<pocket> call\n#1=99\nM98 P[#1+1]\nG1 Z1\nM2\n")
    (tmp_path / "pocket.ngc").write_text("O<pocket> sub\nG1 X5\nO<pocket> endsub\nM2\n")
    (tmp_path / "o0100.nc").write_text("O0100\nG1 Y7\nM99\n")
    bad.write_text("G1 Xq\nM2\n")
    (tmp_path / "tools.tbl").write_text("T1 P1 Z50 D6\n")
    given = (*programs, caller, bad, tmp_path / "missing.ngc", "--tool-table", tmp_path / "tools.tbl")
    options = ("--tolerance", "0.02", "--method", "bang-bang", "--method", "s-curve", "-m", "auto")
    here = run(*given, *options, "-o", tmp_path / "here")
    there = run(*given, *options, "-o", tmp_path / "there", *cluster.options)
    assert (here.code, there.code) == (1, 1)
    assert sorted(here.told.splitlines()) == sorted(there.told.splitlines())
    changing = ("computing",)
    for one, other in zip(rows(tmp_path / "here"), rows(tmp_path / "there"), strict=True):
        for name in changing:
            del one[name], other[name]
        assert one == other
        if one["error"] is None:
            folder = one["folder"]
            assert content(tmp_path / "here" / folder) == content(tmp_path / "there" / folder)
    assert sum(row["error"] is None for row in rows(tmp_path / "there")) == 8
    cluster.wait_until_idle()


def test_a_killed_worker_loses_no_plan(cluster: LocalCluster, tmp_path: Path) -> None:
    programs = write(tmp_path / "in", 30)
    out = tmp_path / "out"
    process = start(*programs, "-o", out, *cluster.options)
    wait_for(lambda: out.exists() and len(list(out.iterdir())) > 3)
    cluster.kill_a_worker()
    done = end(process)
    assert (done.code, done.told) == (0, "")
    assert len({row["folder"] for row in rows(out)}) == 30
    assert all((out / row["folder"] / "plan.json").exists() for row in rows(out))


def test_a_job_that_ends_its_workers_fails_alone(cluster: LocalCluster, tmp_path: Path) -> None:
    deadly = tmp_path / "in" / DEADLY
    programs = write(tmp_path / "in", 3)
    deadly.write_text(PART)
    cluster.wait_for(2)
    jobs = [
        Job(Order(file.name, "auto", "bang-bang", formats=()), file, tmp_path / file.stem)
        for file in (*programs, deadly)
    ]
    place = Cluster(ClusterAddress.of(*cluster.options[1::2]), LIMITS)
    outcomes = place.run(jobs, lambda *_: None, threading.Event())
    place.close()
    assert [outcome.state for outcome in outcomes] == ["done", "done", "done", "failed"]
    assert outcomes[3].failure is not None
    assert outcomes[3].failure.kind == "worker"
    assert (
        "2 workers of the cluster were lost with the job, the last one tls://" in outcomes[3].failure.sentence
    )
    assert not (tmp_path / "deadly").exists()
    cluster.wait_for(2)


def test_an_interrupt_and_a_limit_of_time_end_jobs_on_a_cluster(
    cluster: LocalCluster, tmp_path: Path
) -> None:
    long, out = long_program(tmp_path), tmp_path / "out"
    short = tmp_path / "short.ngc"
    short.write_text("G21 G90 F600\nG1 X10\nM2\n")
    done = run(long, short, *SLOW, "-o", out, "--max-time", "1", *cluster.options)
    assert done.code == 1
    assert [row["error"] for row in rows(out)] == [
        "the job has run for 1 s, all of max_time: choose a quicker method",
        None,
    ]
    process = start(long, *SLOW, "-o", tmp_path / "other", *cluster.options)
    with cluster.client() as client:
        wait_for(lambda: any(client.processing().values()))
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    done = end(process)
    assert (done.code, done.told) == (130, "\nerror: interrupted\n")
    # The workers have stopped their jobs; they also stop if the client is killed.
    cluster.wait_until_idle()
    process = start(long, *SLOW, "-o", tmp_path / "other", *cluster.options)
    with cluster.client() as client:
        wait_for(lambda: any(client.processing().values()))
    process.kill()
    process.communicate()
    cluster.wait_until_idle()


def test_progress_comes_from_the_workers(cluster: LocalCluster, tmp_path: Path) -> None:
    file = long_program(tmp_path)
    order = Order(file.name, "auto", "jerk-limited", formats=())
    place = Cluster(ClusterAddress.of(*cluster.options[1::2]), LIMITS)
    assert place.slots() == 2
    # An interrupt in the middle of a request would print a traceback of tornado.
    assert not logging.getLogger("tornado.application").isEnabledFor(logging.ERROR)
    told: list[tuple[int, str, float]] = []
    stop = threading.Event()

    def hear(number: int, stage: str, part: float) -> None:
        told.append((number, stage, part))
        if stage == "plan" and part > 0:
            stop.set()

    [outcome] = place.run([Job(order, file, tmp_path / "out")], hear, stop)
    place.close()
    assert outcome.state == "stopped"
    assert {number for number, _, _ in told} == {0}
    assert "plan" in [stage for _, stage, _ in told]
    assert not (tmp_path / "out").exists()


def test_runs_of_one_program_are_planned_on_a_cluster(
    cluster: LocalCluster, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "part.ngc"
    file.write_bytes(b"\n".join(long_part().splitlines()[:200]) + b"\nM2\n")
    options = ["plan", str(file), "-q", "--method", "jerk-limited", "--accuracy", "0.01"]
    assert main([*options, "-o", str(tmp_path / "here")]) == 0
    assert main([*options, "-o", str(tmp_path / "there"), *cluster.options]) == 0
    assert content(tmp_path / "here") == content(tmp_path / "there")
    cluster.wait_until_idle()
    capsys.readouterr()
    assert main(["plan", str(file), *cluster.options]) == 2
    assert "the method bang-bang plans in less time" in capsys.readouterr().err
    # The listener ends the plan, and the workers stop.
    long = b"\n".join(long_part().splitlines()[:800]) + b"\nM2\n"
    with ClusterRuns(ClusterAddress.of(*cluster.options[1::2])) as runs:

        def stop(stage: str, part: float) -> None:
            if stage == "plan" and part > 0:
                raise Stopped

        with pytest.raises(Stopped):
            feedplan.plan(long, "mill", "jerk-limited", accuracy=1e-3, progress=stop, elsewhere=runs)
        cluster.wait_until_idle()


def test_a_worker_with_another_feedplan_is_refused_by_name(tmp_path: Path) -> None:
    """The loss of a cluster is one sentence, and a batch continues on another cluster."""
    package = tmp_path / "other"
    shutil.copytree(Path(feedplan.__file__).parent, package / "feedplan")
    (package / "feedplan" / "py.typed").write_text("changed")
    short = write(tmp_path, 1)
    with running(tmp_path / "cluster", 1, PYTHONPATH=str(package)) as other:
        done = run(*short, "-o", tmp_path / "out", *other.options)
        assert (done.code, done.said) == (2, "")
        assert done.told.startswith("error: the worker tcp://127.0.0.1:")
        assert " has another feedplan, 0.1.0 (" in done.told
        assert not (tmp_path / "out").exists()
        # A worker that joins later is checked by its first job.
        with other.client() as client:
            [returned] = client.submit(cluster_task.run, "name", "0.0.1", (1.0, 1.0), [None]).result()
        assert "has another feedplan, 0.1.0 (" in returned.outcome
        assert "than 0.0.1: install that" in returned.outcome
        other.kill_scheduler()
        done = run(*short, "-o", tmp_path / "out", *other.options, "-q")
        assert done.code == 2
        assert f"the cluster at {other.url} cannot be reached (" in done.told


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (
            ("10.0.0.5:8786",),
            "is not on this computer and its line is open .*: give it as tls://, with --tls-ca",
        ),
        (("tcp://planner:8786",), "the cluster at tcp://planner:8786 is not on this computer"),
        (
            ("tls://planner:8786",),
            "asks for certificates: give --tls-ca and --tls-cert and --tls-key as well",
        ),
        (
            ("tls://planner:8786", "a", "b", "c"),
            r"cannot be used \(no such file or directory\): give files in PEM",
        ),
        (("127.0.0.1:8786", "a"), "--tls-ca is for a line by TLS: give the cluster as tls://"),
        (("127.0.0.1",), "the address of the cluster is '127.0.0.1': give one such as tcp://127.0.0.1:8786"),
        (
            ("ucx://127.0.0.1:1",),
            "the address of the cluster is 'ucx://127.0.0.1:1': give one such as tcp://",
        ),
        (("tcp://127.0.0.1:99999",), "the address of the cluster is "),
    ],
)
def test_a_line_that_others_could_use_is_refused(given: tuple[str, ...], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        ClusterAddress.of(*given)


def test_addresses_of_this_computer_need_no_certificates() -> None:
    for given, url in (
        ("127.0.0.1:8786", "tcp://127.0.0.1:8786"),
        ("tcp://localhost:8786", "tcp://localhost:8786"),
        ("tcp://[::1]:8786/", "tcp://[::1]:8786"),
    ):
        assert ClusterAddress.of(given).url == url


def test_files_that_a_program_calls_are_found_in_its_text(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    for folder in (one, other):
        folder.mkdir()
    for name, text in {
        "a.ngc": "O<a> sub\nO <b c> call\nO<a> endsub",
        "b.ngc": "",
        "o0007.nc": "M98 P8",
        "8": "",
        "unused.ngc": "",
        "12.ngc": "",
    }.items():
        (one / name).write_text(text)
    (other / "a.ngc").write_text("not this one")
    (other / "bc.ngc").write_text("this one")
    folders = (one, other)
    assert set(called_files(b"o<A> call [1]\n", folders)) == {"a.ngc", "bc.ngc"}
    assert called_files(b"o<A> call\n", folders)["a.ngc"].startswith(b"O<a> sub")
    assert set(called_files(b"M98 P7 L2\n", folders)) == {"o0007.nc", "8"}
    assert set(called_files(b"M98 P#1\n", folders)) == {"o0007.nc", "8", "12.ngc"}
    assert called_files(b"G1 X1 P7\n", folders) == {}
    assert called_files(b"M98 P7\n", ()) == {}
