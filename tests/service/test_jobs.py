"""Jobs from the request to the results, as clients see them."""

from __future__ import annotations

import io
import json
import math
import socket
import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest

import feedplan
from feedplan.machine.controller import MODELS, Controller
from feedplan.machine.machine import Machine
from feedplan.outputs import format_named
from feedplan.outputs.npz import load
from feedplan.service import exports
from tests.service.servers import ENDED, LONG, PART, Answer, Server, events_of, long_part

MINE = (Path(__file__).parents[2] / "examples" / "mine.toml").read_text("utf-8")
NAMES = ("t", "position", "velocity", "acceleration", "jerk", "line")


def test_a_service_plans_as_the_package_does(server: Server, tmp_path: Path) -> None:
    answer = server.submit(PART, file="plate.ngc")
    assert answer.status == 202
    job = answer.json
    assert answer.headers["location"] == job["links"]["self"] == f"/v1/jobs/{job['id']}"
    assert job["state"] == "queued"
    assert (job["program"]["name"], job["program"]["bytes"], job["program"]["lines"]) == (
        "plate.ngc",
        len(PART),
        6,
    )
    done = server.wait(job["id"])
    local = feedplan.plan(PART, "mill")
    assert done["state"] == "done"
    assert done["done"] == 1.0
    assert done["created"] <= done["started"] <= done["finished"]
    assert done["result"]["time"] == local.time
    assert done["result"]["lower_bound"] == local.lower_bound
    assert done["result"]["ok"]
    links = done["links"]
    summary = server.get(links["result"]).json
    own = json.loads(json.dumps(local.summary()))
    for ours in (summary, own):
        del ours["compute"], ours["program"]
    assert summary == own
    assert server.get(links["audit"]).json == own["audit"]
    assert server.get(links["program"]).content == PART
    report = server.get(links["report"])
    assert report.headers["content-type"].startswith("text/html")
    assert "sandbox" in report.headers["content-security-policy"]
    assert b"plate.ngc" in report.content
    (tmp_path / "setpoints.npz").write_bytes(server.get(links["setpoints"]).content)
    points, expected = load(tmp_path / "setpoints.npz"), local.setpoints().all()
    assert all(np.array_equal(getattr(points, name), getattr(expected, name)) for name in NAMES)


def test_a_request_is_json_as_well(server: Server) -> None:
    answer = server.submit_json(machine=MINE, method="jerk-limited", options={"tolerance": 0.02, "feed": 10})
    done = server.wait(answer.json["id"])
    assert done["state"] == "done"
    assert (done["machine"], done["method"]) == ("mine", "jerk-limited")
    local = feedplan.plan(
        PART, feedplan.Machine.load("examples/mine.toml"), "jerk-limited", tolerance=0.02, feed=10.0
    )
    assert done["result"]["time"] == local.time
    path = {"curves": [{"degree": 2, "control_points": [[0, 0], [10, 0], [10, 10]]}], "feed": 80.0}
    done = server.wait(server.submit_json(program=path, name="").json["id"])
    assert done["program"]["name"] == "path.json"
    assert done["result"]["time"] == feedplan.plan(json.dumps(path) + "\n", "mill").time


def test_the_machine_is_found_and_tools_have_their_lengths(server: Server) -> None:
    program = b"G21 G90 T1 M6 G43 H1 G0 Z20\nG1 F600 Z5\nX3\nM2\n"
    fields = {"machine": "auto", "tool_table": "T1 P1 Z50 D6\n", "options": '{"whole_step": 0.5}'}
    done = server.planned(program, **fields)
    assert done["state"] == "done", done["problem"]
    assert done["machine"] == "auto"
    summary = server.get(done["links"]["result"]).json
    assert summary["machine"] == "mill"
    assert server.planned(program, machine="auto")["result"]["time"] != done["result"]["time"]


def test_an_equal_request_is_not_planned_twice(server: Server) -> None:
    first = server.submit(options='{"tolerance": 0.031}').json
    again = server.submit(options='{"tolerance": 0.0310}')
    assert (again.status, again.json["id"]) == (200, first["id"])
    server.wait(first["id"])
    as_json = server.submit_json(options={"tolerance": 0.031})
    assert (as_json.status, as_json.json["id"]) == (200, first["id"])
    starts = [data for _, kind, data in events_of(server, first["id"]) if data == {"state": "running"}]
    assert len(starts) == 1
    others = [
        server.submit(options='{"tolerance": 0.032}'),
        server.submit(PART + b"\n", options='{"tolerance": 0.031}'),
        server.submit(file="other.ngc", options='{"tolerance": 0.031}'),
        server.submit(machine="router", options='{"tolerance": 0.031}'),
        server.submit(method="tangential", options='{"tolerance": 0.031}'),
    ]
    assert {answer.status for answer in others} == {202}
    assert len({answer.json["id"] for answer in others}) == len(others)
    # The text of a bundled machine is recognised as that machine.
    as_text = server.submit(machine=feedplan.Machine.load("mill").to_toml(), options='{"tolerance": 0.031}')
    assert as_text.json["id"] == first["id"]


def test_many_equal_requests_at_a_time_are_one_job(server: Server) -> None:
    found = []
    threads = [
        threading.Thread(target=lambda: found.append(server.submit(options='{"tolerance": 0.041}')))
        for _ in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(answer.status for answer in found) == [200] * 7 + [202]
    assert len({answer.json["id"] for answer in found}) == 1


def test_a_key_gives_one_job(server: Server) -> None:
    bad = b"G1 Xq\nM2\n"
    first = server.submit(bad, key="key-1").json
    server.wait(first["id"])
    assert server.submit(bad, key="key-1").json["id"] == first["id"]
    assert server.submit(bad).json["id"] != first["id"], "what failed is planned anew"
    other = server.submit(PART, key="key-1")
    assert other.status == 422
    assert "Idempotency-Key was used for another request: choose a new key" in other.detail


def test_an_error_in_a_program_has_file_and_line(server: Server) -> None:
    done = server.planned(b"G21 G90\nF1200\nG1 Xq\nM2\n", file="bad.ngc")
    assert (done["state"], done["result"]) == ("failed", None)
    problem = done["problem"]
    assert (problem["type"], problem["file"], problem["line"]) == ("urn:feedplan:program", "bad.ngc", 3)
    assert problem["detail"].startswith("bad.ngc line 3: word Xq is not understood: ")
    assert problem["remedy"] == "remove it, or post the program for LinuxCNC (RS-274/NGC)"
    for part in ("result", "audit", "setpoints", "report"):
        answer = server.get(done["links"][part])
        assert (answer.status, answer.json["line"]) == (409, 3)
        assert answer.detail == problem["detail"]
    assert server.get(done["links"]["program"]).status == 200


@pytest.mark.parametrize(
    ("fields", "kind", "sentence"),
    [
        ({"machine": "milll"}, "machine", "there is no machine of this name: use one of auto, corexy, "),
        ({"machine": "../../etc/passwd"}, "machine", "there is no machine of this name: use one of "),
        ({"machine": "/etc/machine.toml"}, "machine", "there is no machine of this name: use one of "),
        ({"machine": "name = 3"}, "machine", "machine file of the request: axes is "),
        (
            {"method": "best"},
            "input",
            f"method: input should be {', '.join(map(repr, feedplan.methods()[:-1]))} or 'toppra': ",
        ),
        ({"options": '{"accuracy": 0.1}'}, "input", "the method bang-bang takes no accuracy: leave it out"),
        ({"options": '{"tolerance": -1}'}, "input", "options.tolerance: input should be greater than 0: "),
        ({"options": '{"tolerance": NaN}'}, "input", "options.tolerance: input should be a finite number: "),
        ({"options": '{"tolerance": "1"}'}, "input", "options.tolerance: input should be a valid number: "),
        ({"options": '{"reading": {}}'}, "input", "options.reading: extra inputs are not permitted: "),
        ({"options": "{"}, "input", "options: invalid JSON: "),
        (
            {"options": '{"tolerance": 0.1, "tolerance": 0.01}'},
            "input",
            "options: 'tolerance' comes twice in one object: give it once",
        ),
        ({"name": "x" * 121}, "input", "name: string should have at most 120 characters: "),
        ({"subprograms": "/etc"}, "input", "the form has 'subprograms' too often or wrongly: give program, "),
    ],
)
def test_a_wrong_request_is_refused_at_once(
    server: Server, fields: dict[str, str], kind: str, sentence: str
) -> None:
    answer = server.submit(**fields)
    assert answer.status == 422
    assert answer.detail.startswith(sentence)
    assert answer.json["type"] == f"urn:feedplan:{kind}"
    assert answer.json["remedy"]


def test_other_bodies_are_refused(server: Server) -> None:
    def sent(kind: str, body: bytes) -> int:
        return server.send("POST", "/v1/jobs", body, {"Content-Type": kind}).status

    assert sent("text/plain", PART) == 415
    twice = b'{"program": "G1 X1 F9\\nM2\\n", "machine": "mill", "machine": "router"}'
    said = server.send("POST", "/v1/jobs", twice, {"Content-Type": "application/json"}).detail
    assert said == "the request: 'machine' comes twice in one object: give it once"
    assert sent("application/json", b"[]") == 422
    assert sent("application/json", b'{"program": "\\ud800"}') == 422
    assert sent("application/json", b"[" * 100_000) == 422
    assert sent("application/json", b'{"program": {"curves": ' + b"1" * 5000 + b"}}") == 422
    number = server.send("POST", "/v1/jobs", b'{"program": 5}', {"Content-Type": "application/json"})
    assert number.detail.startswith("program: input should be a valid string: ")
    assert sent("multipart/form-data", PART) == 400
    headers = {"Content-Type": "multipart/form-data"}
    said = server.send("POST", "/v1/jobs", PART, headers).detail
    assert said == "missing boundary in multipart: correct the request"
    assert sent("multipart/form-data; boundary=x", b"--x\r\n" * 50) == 400
    assert server.submit(b"").detail == "the program is empty: give a part program"
    assert server.get("/v1/nothing").status == 404
    assert server.send("PUT", "/v1/jobs").status == 405


def test_head_tells_what_get_has_without_the_content(server: Server) -> None:
    links = server.planned()["links"]
    for address in ("/", "/v1/health", links["self"], links["result"], links["report"], links["program"]):
        get, head = server.get(address), server.send("HEAD", address)
        assert (head.status, head.content) == (200, b"")
        assert {**head.headers, "date": ""} == {**get.headers, "date": ""}
    running = server.submit(long_part(7), **LONG).json["links"]
    began = time.monotonic()
    assert server.send("HEAD", running["events"]).status == 200
    assert time.monotonic() - began < 2.0, "a stream without content has an end"
    server.send("DELETE", running["self"])
    assert server.send("HEAD", "/v1/jobs/none").status == 404
    assert server.send("HEAD", f"{links['self']}/cancel").status == 405


def test_a_sent_program_cannot_call_files_and_its_name_is_no_path(server: Server) -> None:
    for program in (b"O<passwd> call\nG0 X1\nM2\n", b"M98 P1000\nG0 X1\nM2\n"):
        assert server.planned(program)["state"] == "failed"
    for name in ("../../../tmp/x.ngc", "/etc/passwd", "C:\\x\\y.ngc", "..", "<i onload=x>.ngc"):
        done = server.planned(PART, file=name)
        assert done["state"] == "done"
        assert "/" not in done["program"]["name"]
        assert b"<i onload" not in server.get(done["links"]["report"]).content.split(b"<script", 1)[0]
    assert server.get("/v1/jobs/..%2f..%2fjobs.sqlite").status == 404
    assert server.get("/v1/machines/..%2f..%2fetc").status == 404


def test_setpoints_by_time_and_axis_in_every_format(server: Server, tmp_path: Path) -> None:
    done = server.planned()
    whole = feedplan.plan(PART, "mill").setpoints().all()
    rows = slice(int(np.searchsorted(whole.t, 0.25)), int(np.searchsorted(whole.t, 0.5, "right")))
    for name in exports.formats():
        file = tmp_path / format_named(name).FILE
        query = {"format": name, "from": 0.25, "to": 0.5, "axes": "Z,X"}
        answer = server.get(done["links"]["setpoints"], **query)
        assert answer.headers["content-disposition"] == f'attachment; filename="{file.name}"'
        file.write_bytes(answer.content)
        points = format_named(name).load(file)
        assert points.axes == ("Z", "X")
        assert np.array_equal(points.position, whole.position[rows][:, [2, 0]])
        if not len(points.velocity):  # a stream has positions only, and begins at 0 s
            continue
        assert np.array_equal(points.t, whole.t[rows])
        assert np.array_equal(points.line, whole.line[rows])
        for quantity in ("velocity", "acceleration", "jerk"):
            assert np.array_equal(getattr(points, quantity), getattr(whole, quantity)[rows][:, [2, 0]])
    one = server.get(done["links"]["setpoints"], format="csv", to=0.0).content.splitlines()
    assert [line[:2] for line in one if not line.startswith((b"#", b"t "))] == [b"0,"]
    for query, sentence in (
        ({"axes": "Q"}, "the plan has no axis Q: give some of X, Y, Z"),
        ({"axes": "X,X"}, "axes has an axis twice: give each once"),
        ({"from": 1e9}, "there are no setpoints from 1e+09 to "),
        ({"to": -5}, "there are no setpoints from 0 to -5 s: give times within 0 to "),
        ({"axes": ["X", "Y"]}, "query.axes: it comes more than once: give it once"),
        ({"from": 0.5, "to": 0.2}, "there are no setpoints from 0.5 to 0.2 s: give times within 0 to "),
        ({"from": "nan"}, "query.from: input should be a finite number"),
        ({"format": "xls"}, "query.format: input should be "),
        ({"form": "csv"}, "query.form: there is no such parameter: give from, to, axes, format"),
        ({"format": "pvt"}, "pvt has no rows at servo periods: give one of csv, "),
    ):
        answer = server.get(done["links"]["setpoints"], **query)
        assert answer.status == 422
        assert answer.detail.startswith(sentence)


def test_events_report_progress_and_continue_after_the_last_one(server: Server) -> None:
    job = server.submit(options='{"tolerance": 0.051}').json["id"]
    events = events_of(server, job)
    assert [number for number, _, _ in events] == list(range(1, len(events) + 1))
    states = [data["state"] for _, kind, data in events if kind == "state"]
    assert states == ["queued", "running", "done"]
    done = [data["done"] for _, kind, data in events if kind == "progress"]
    assert done == sorted(done)
    stages = list(dict.fromkeys(data["stage"] for _, kind, data in events if kind == "progress"))
    assert stages == ["read", "fit", "plan", "audit", "write"]
    assert events_of(server, job, last=3) == events[3:]
    assert (
        server.send("GET", f"/v1/jobs/{job}/events", headers={"Last-Event-ID": str(len(events))}).status
        == 204
    )
    assert events_of(server, job, last=0) == events


def test_jobs_are_cancelled_and_deleted_while_they_run(server: Server) -> None:
    jobs = [server.submit(long_part(seed), **LONG).json["id"] for seed in range(3)]
    running = server.wait(jobs[0], "running")
    assert running["stage"] in ("read", "fit", "plan", "audit", "write")
    server.wait(jobs[1], "running")
    assert server.get(f"/v1/jobs/{jobs[2]}").json["state"] == "queued"
    for part in ("result", "report", "setpoints"):
        answer = server.get(running["links"][part])
        assert (answer.status, answer.detail) == (
            409,
            "the job is running: wait for its end, /events tells it",
        )
    waiting = server.send("POST", f"/v1/jobs/{jobs[2]}/cancel")
    assert (waiting.status, waiting.json["state"]) == (202, "cancelled")
    assert server.send("POST", f"/v1/jobs/{jobs[0]}/cancel").status == 202
    assert server.wait(jobs[0], seconds=10)["state"] == "cancelled"
    folder = server.store / "jobs"
    assert sorted(file.name for file in (folder / jobs[0]).iterdir()) == ["program"]
    assert server.send("DELETE", f"/v1/jobs/{jobs[1]}").status == 204
    assert server.get(f"/v1/jobs/{jobs[1]}").status == 404
    assert server.send("DELETE", f"/v1/jobs/{jobs[1]}").status == 404
    assert server.send("DELETE", f"/v1/jobs/{jobs[2]}").status == 204
    assert server.planned(options='{"tolerance": 0.061}')["state"] == "done", "the workers are free again"
    # The folder is removed when the process of the job has ended; no request waits for this.
    end = time.monotonic() + 10.0
    while (folder / jobs[1]).exists() and time.monotonic() < end:
        time.sleep(0.05)
    assert not (folder / jobs[1]).exists()
    assert not (folder / jobs[2]).exists()
    again = server.send("POST", f"/v1/jobs/{jobs[0]}/cancel")
    assert again.json["state"] == "cancelled"


def test_jobs_are_listed_and_compared(server: Server) -> None:
    methods = ("bang-bang", "junction-deviation")
    done = [server.planned(method=method) for method in methods]
    failed = server.planned(b"G1 Xq\n")
    newest = server.get("/v1/jobs", count=1).json
    assert newest["jobs"][0]["id"] == failed["id"]
    second = server.get("/v1/jobs", count=1, before=newest["before"]).json
    assert second["jobs"][0]["id"] != failed["id"]
    assert {job["state"] for job in server.get("/v1/jobs", state="failed").json["jobs"]} == {"failed"}
    rows = server.get("/v1/compare", job=[job["id"] for job in (*done, failed)]).json["rows"]
    local = feedplan.compare(PART, "mill", methods)
    assert [row["time"] for row in rows] == [*(row.time for row in local), None]
    assert rows[2]["error"] == failed["problem"]["detail"]
    for row, own in zip(rows, local, strict=False):
        assert row["ok"] == own.plan.audit().ok
        for name, check in row["worst"].items():
            assert check["ratio"] == own.worst(name).ratio
    assert server.get("/v1/compare").status == 422
    assert server.get("/v1/compare", job=["x"]).status == 404


def test_machines_methods_and_health(server: Server) -> None:
    machines = server.get("/v1/machines").json["machines"]
    assert tuple(row["name"] for row in machines) == feedplan.machines()
    tarus = server.get("/v1/machines/tarus").json
    assert [axis["max_velocity"] for axis in tarus["axes"]] == [170.0, 180.0, 240.0]
    assert feedplan.Machine.load("tarus").to_toml() == tarus["file"]
    methods = {row["name"]: row["options"] for row in server.get("/v1/methods").json["methods"]}
    assert tuple(methods) == feedplan.methods()
    assert methods["jerk-limited"] == {"accuracy": 1e-4, "time_limit": None}
    health = server.get("/v1/health").json
    assert (health["status"], health["version"]) == ("ok", feedplan.__version__)
    assert health["limits"]["workers"] == {"value": 2, "unit": "processes"}


def test_options_that_are_whole_numbers_stay_so(server: Server) -> None:
    job = server.planned(method="junction-deviation", options='{"blocks": 15}')
    assert (job["state"], job["options"]) == ("done", {"blocks": 15})


def test_a_machine_file_is_described_with_changed_limits(server: Server) -> None:
    def told(machine: str, **limits: Any) -> Answer:
        body = json.dumps({"machine": machine, "limits": limits}).encode()
        return server.send("POST", "/v1/machines", body, {"Content-Type": "application/json"})

    twice = b'{"machine": "mill", "limits": {"X": {"max_jerk": 5e4, "max_jerk": 6e4}}}'
    for body, sentence in (
        (twice, "the request: 'max_jerk' comes twice in one object: give it once"),
        (b"{", "body.1: JSON decode error: correct it as the documentation at /docs tells"),
    ):
        answer = server.send("POST", "/v1/machines", body, {"Content-Type": "application/json"})
        assert (answer.status, answer.detail) == (422, sentence)
    own = replace(feedplan.Machine.load("tarus"), controller=Controller("grbl", {"junction_deviation": 0.02}))
    plain = told(own.to_toml()).json
    assert plain == {**server.get("/v1/machines/tarus").json, "file": own.to_toml()} | {
        "controller": {"name": "grbl", "parameters": {"junction_deviation": 0.02}}
    }
    other = told("tarus", X={"max_velocity": [-100.0, 120.0], "max_jerk": None}).json
    assert other["axes"][0]["max_velocity"] == [-100.0, 120.0]
    assert other["axes"][0]["max_jerk"] is None
    assert other["axes"][1:] == plain["axes"][1:]
    assert Machine.from_toml(other["file"], "other").axis("X").max_jerk == math.inf
    for machine, limits, said in (
        ("tarus", {"X": {"max_velocity": -1.0}}, "axis X: max_velocity is -1.0: give"),
        ("tarus", {"X": {"max_velocity": None}}, "axis X: max_velocity is None: give"),
        ("tarus", {"Q": {}}, "the machine tarus has no axis Q: give some of X, Y, Z"),
        ("name = ", {}, "machine file of the request is not valid TOML"),
        ("auto", {}, "there is no machine of this name: use one of "),
    ):
        assert told(machine, **limits).detail.startswith(said)
    controllers = {row["name"]: row for row in server.get("/v1/controllers").json["controllers"]}
    assert tuple(controllers) == tuple(MODELS)
    for name, row in controllers.items():
        defaults = {own["option"]: own["default"] for own in row["parameters"].values()}
        given = {option: value for option, value in defaults.items() if value is not None}
        assert {**row["options"], **given} == Controller(name).options


def test_no_received_or_made_file_is_left(server: Server) -> None:
    assert list((server.store / "new").iterdir()) == []
    known = {job["id"] for job in server.get("/v1/jobs", count=200).json["jobs"]}
    assert {folder.name for folder in (server.store / "jobs").iterdir()} <= known
    assert all(job["state"] in ENDED for job in server.get("/v1/jobs", count=200).json["jobs"])


def test_a_client_that_leaves_during_an_upload_leaves_no_file(server: Server) -> None:
    parts = urlsplit(server.url)
    before = server.get("/v1/jobs", count=1).json
    for kind in ("application/json", "multipart/form-data; boundary=x"):
        with socket.create_connection((parts.hostname, parts.port)) as line:
            head = f"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: {kind}\r\n"
            line.sendall(f"{head}Content-Length: 1000\r\n\r\n--x\r\n".encode())
    assert server.get("/v1/jobs", count=1).json == before


def test_the_program_may_be_any_bytes(server: Server) -> None:
    program = b"(Fr\xe4sen \xff)\n" + PART
    done = server.planned(program)
    assert done["state"] == "done"
    assert io.BytesIO(server.get(done["links"]["program"]).content).read() == program
