"""Damaged requests: each gets an answer in one sentence, no file is lost or left over, memory is bounded."""

from __future__ import annotations

import json
import random
import time
from collections.abc import Callable
from pathlib import Path

from feedplan.client.transport import form
from feedplan.errors import LONGEST
from tests.campaign import seeds
from tests.hostile import DRAWING, MACHINE, PATH_FILE, PROGRAM, mutated
from tests.service.servers import ENDED, Answer, Server

SEEDS = seeds(120)
# Greatest allowed growth of memory by small requests [bytes].
GROWTH = 1 << 28
FIELDS = {
    "machine": MACHINE.decode(),
    "method": "bang-bang",
    "options": '{"max_setpoints": 20000, "feed": 20}',
}
Request = tuple[bytes, dict[str, str]]


def of_form(fields: dict[str, str], program: bytes, name: str) -> Request:
    body, kind = form(fields, program, name)
    return body, {"Content-Type": kind}


def of_program(seed: int, draw: random.Random) -> Request:
    content, name = draw.choice(
        ((PROGRAM, "a.ngc"), (PATH_FILE, "a.json"), (DRAWING, "a.dxf"), (PROGRAM, ""))
    )
    return of_form({**FIELDS, "machine": "mill"}, mutated(content, seed), name)


def of_field(seed: int, draw: random.Random) -> Request:
    """A form with one damaged field; None if a form cannot hold the value."""
    name = draw.choice(tuple(FIELDS))
    return of_form({**FIELDS, name: mutated(FIELDS[name].encode(), seed).decode("latin-1")}, PROGRAM, "a.ngc")


def of_body(seed: int, draw: random.Random) -> Request:
    body, headers = of_form(FIELDS, PROGRAM, draw.choice(("../../x", "a\x00b", "é" * 50, "a.ngc")))
    return mutated(body, seed), headers


def of_json(seed: int, draw: random.Random) -> Request:
    program = draw.choice((PROGRAM.decode(), json.loads(PATH_FILE)))
    text = json.dumps({"program": program, "name": "", "machine": "mill", "options": {"feed": 20}})
    return mutated(text.encode(), seed), {"Content-Type": "application/json"}


def of_headers(seed: int, draw: random.Random) -> Request:
    body, headers = of_form(FIELDS, PROGRAM, "a.ngc")
    name = draw.choice(("Content-Type", "Idempotency-Key"))
    value = mutated(headers.get(name, "key").encode(), seed).decode("latin-1")
    return body, {**headers, name: "".join(letter for letter in value if " " <= letter != "\x7f")[:3000]}


REQUESTS: tuple[Callable[[int, random.Random], Request], ...] = (
    *(of_program, of_program, of_program, of_field, of_body, of_json, of_headers),
)


def sent(server: Server, body: bytes, headers: dict[str, str]) -> Answer:
    """Repeats a request until the queue has room; returns the answer."""
    while True:
        answer = server.send("POST", "/v1/jobs", body, headers)
        if answer.status != 429:
            return answer
        time.sleep(0.1)


def test_hostile_requests(server: Server) -> None:
    before, accepted, wrong = server.memory, set(), []
    for seed in range(SEEDS):
        draw = random.Random(seed)
        make = draw.choice(REQUESTS)
        answer = sent(server, *make(seed, draw))
        if answer.status in (200, 202):
            accepted.add(answer.json["id"])
        elif not (400 <= answer.status < 500 and 0 < len(answer.detail) <= LONGEST):
            wrong.append((seed, make.__name__, answer.status, answer.content[:300]))
    assert wrong == []
    for job in accepted:
        done = server.wait(job, seconds=300)
        problem = done["problem"]
        if problem is not None and problem["status"] not in (422, 507):
            wrong.append((job, problem))
        if problem is not None:
            assert str(server.store) not in problem["detail"]
            assert 0 < len(problem["detail"]) <= LONGEST
    assert wrong == []
    assert len(accepted) > SEEDS // 10
    assert server.memory - before < GROWTH
    assert list((server.store / "new").iterdir()) == []
    listed = {folder.name for folder in Path(server.store / "jobs").iterdir()}
    assert accepted <= listed
    assert all(server.get(f"/v1/jobs/{job}").json["state"] in ENDED for job in listed)
