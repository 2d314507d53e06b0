"""The service's queue on a Dask cluster: jobs run as on one computer, also after losses of the cluster."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from feedplan.service.runner import AWAY
from tests.batch.batches import content, wait_for
from tests.clusters import DEADLY, HELD, LocalCluster
from tests.clusters import running as cluster_running
from tests.service.servers import LONG, PART, Server, events_of, long_part, running


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalCluster]:
    with cluster_running(tmp_path_factory.mktemp("cluster"), 2) as found:
        yield found


@pytest.fixture(scope="module")
def planner(cluster: LocalCluster, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server whose jobs run on the cluster."""
    with running(tmp_path_factory.mktemp("store"), "--max-time", "30", *cluster.options) as found:
        yield found


def test_a_job_has_the_files_that_it_has_on_this_computer(planner: Server, server: Server) -> None:
    fields = {"file": "plate.ngc", "machine": "auto", "tool_table": "T1 P1 Z50 D6\n"}
    program = b"T1 M6 G43 H1\n" + PART
    there, here = (each.planned(program, **fields) for each in (planner, server))
    assert there["state"] == here["state"] == "done"
    assert there["result"] == here["result"]
    own, other = (
        next((each.store / "jobs" / done["id"]).glob("result-*"))
        for each, done in ((planner, there), (server, here))
    )
    assert content(own) == content(other)
    assert "drawing.bin" in content(own)
    kinds = [data for _, kind, data in events_of(planner, there["id"]) if kind == "state"]
    assert [data["state"] for data in kinds] == ["queued", "running", "done"]


def test_errors_limits_and_progress_are_those_of_this_computer(planner: Server) -> None:
    problem = planner.planned(b"G21 G90\nF1200\nG1 Xq\nM2\n", file="bad.ngc")["problem"]
    assert (problem["type"], problem["file"], problem["line"]) == ("urn:feedplan:program", "bad.ngc", 3)
    assert planner.planned(b"O<passwd> call\nG0 X1\nM2\n")["problem"]["type"] == "urn:feedplan:program"
    asked = planner.planned(options='{"max_setpoints": 10}')["problem"]
    assert asked["limit"] == {"name": "max_setpoints", "value": 10, "unit": "setpoints"}
    deadly = planner.planned(file=DEADLY)
    assert deadly["problem"]["type"] == "urn:feedplan:worker"
    assert "workers of the cluster were lost with the job" in deadly["problem"]["detail"]


def test_jobs_are_cancelled_and_deleted_while_they_run(planner: Server, cluster: LocalCluster) -> None:
    cluster.wait_for(2)
    jobs = [planner.submit(long_part(seed), **LONG).json["id"] for seed in range(3)]
    for job in jobs[:2]:
        wait_for(lambda job=job: planner.get(f"/v1/jobs/{job}").json["stage"] in ("fit", "plan"))
    assert planner.get(f"/v1/jobs/{jobs[2]}").json["state"] == "queued", "as many run as there are threads"
    assert planner.send("POST", f"/v1/jobs/{jobs[0]}/cancel").status == 202
    assert planner.wait(jobs[0], seconds=10)["state"] == "cancelled"
    planner.wait(jobs[2], "running")
    for job in jobs[1:]:
        assert planner.send("DELETE", f"/v1/jobs/{job}").status == 204
    wait_for(
        lambda: sorted(place.name for place in (planner.store / "jobs" / jobs[0]).iterdir()) == ["program"]
    )
    wait_for(lambda: not any((planner.store / "jobs" / job).exists() for job in jobs[1:]))
    cluster.wait_until_idle()


def test_a_job_outlives_its_worker_and_a_server_its_end(
    cluster: LocalCluster, tmp_path: Path, server: Server
) -> None:
    def read(job: str) -> None:
        """Waits until a worker reads the program of the job."""
        wait_for(lambda: own.get(f"/v1/jobs/{job}").json["stage"] == "read")

    own = Server(tmp_path, *cluster.options)
    medium = b"\n".join(long_part().splitlines()[:1000]) + b"\nM2\n"
    fields = {"file": HELD, "method": "jerk-limited", "options": '{"accuracy": 0.05}'}
    first, second = (own.submit(medium + b"(%d)\n" % k, **fields).json["id"] for k in range(2))
    read(first)
    cluster.kill_a_worker()
    # No job is lost when the scheduler is restarted or the server is killed.
    cluster.wait_for(2)
    read(second)
    cluster.kill_scheduler()
    for job in (first, second):
        wait_for(lambda job=job: own.get(f"/v1/jobs/{job}").json["state"] == "queued")
    time.sleep(AWAY + 0.5)  # no job is started while the cluster is away
    cluster.start_scheduler()
    for _ in range(2):  # the workers have ended with the scheduler
        cluster.start_worker()
    read(second)
    own.process.kill()
    own.process.communicate()
    own.start()
    read(first)
    cluster.release()
    results = [own.wait(job)["result"] for job in (first, second)]
    states = [data["state"] for _, kind, data in events_of(own, first) if kind == "state"]
    assert own.end() == ""
    here = server.planned(medium + b"(0)\n", **fields)["result"]
    assert json.dumps(results[0]) == json.dumps(results[1]) == json.dumps(here)
    assert states == ["queued", "running", "queued", "running", "queued", "running", "done"]


def test_a_service_beyond_this_computer_needs_tls(tmp_path: Path) -> None:
    with pytest.raises(
        AssertionError, match=r"the cluster at tcp://10\.0\.0\.5:8786 is not on this computer"
    ):
        Server(tmp_path, "--cluster", "tcp://10.0.0.5:8786")
