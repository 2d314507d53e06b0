"""Token, Host and Origin are checked before a body is read, and the address before the service starts."""

from __future__ import annotations

import asyncio
import base64
import json
from pathlib import Path
from typing import Any

import pytest

from feedplan import Client, InputError
from feedplan.cli import main
from feedplan.service.guard import Guard
from feedplan.service.limits import Limits
from tests.service.servers import running

TOKEN = "0123456789abcdef-token"
GOOD = {"host": "localhost:8000", "authorization": f"Bearer {TOKEN}"}


def asked(headers: dict[str, str], path: str = "/v1/jobs", token: str | None = TOKEN) -> tuple[int, str]:
    """Status and sentence of the answer; status 299 if the guard lets the request through."""
    sent: list[dict[str, Any]] = []

    async def app(scope: Any, receive: Any, send: Any) -> None:
        await send({"type": "http.response.start", "status": 299, "headers": []})
        await send({"type": "http.response.body", "body": b'{"detail": ""}'})

    async def receive() -> Any:
        raise AssertionError("the body is read")

    async def send(message: Any) -> None:
        sent.append(message)

    pairs = [(name.encode(), value.encode()) for name, value in headers.items()]
    scope = {"type": "http", "scheme": "http", "path": path, "method": "POST", "headers": pairs}
    asyncio.run(Guard(app, Limits(), ["localhost", "planner.shop"], token)(scope, receive, send))
    names = {name for name, _ in sent[0]["headers"]}
    assert {b"cache-control", b"x-content-type-options"} <= names
    assert b"access-control-allow-origin" not in names
    if sent[0]["status"] != 299:
        assert (b"connection", b"close") in sent[0]["headers"]
    return sent[0]["status"], json.loads(sent[1]["body"])["detail"]


@pytest.mark.parametrize(
    "host", ["localhost:8000", "localhost", "PLANNER.shop", "127.0.0.1:1", "[::1]:8000", "10.0.0.7"]
)
def test_names_of_the_service_are_let_through(host: str) -> None:
    assert asked(GOOD | {"host": host})[0] == 299


@pytest.mark.parametrize(
    "host", ["", "evil.example", "localhost.evil.example", "localhost@evil", "127.0.0.1.evil.example"]
)
def test_other_names_are_refused(host: str) -> None:
    status, said = asked(GOOD | {"host": host})
    assert status == 403
    assert said.startswith(f"the service is not known as '{host}': use localhost, planner.shop, or add")


@pytest.mark.parametrize(
    ("origin", "status"),
    [
        ("http://localhost:8000", 299),
        ("http://LOCALHOST:8000", 299),
        ("https://localhost:8000", 403),
        ("http://localhost:8001", 403),
        ("http://evil.example", 403),
        ("null", 403),
        ("", 403),
    ],
)
def test_pages_of_other_origins_are_refused(origin: str, status: int) -> None:
    assert asked(GOOD | {"origin": origin})[0] == status


def test_the_token_is_needed_and_compared_whole() -> None:
    basic = base64.b64encode(f"me:{TOKEN}".encode()).decode()
    for good in (f"Bearer {TOKEN}", f"bearer {TOKEN}", f"Basic {basic}"):
        assert asked(GOOD | {"authorization": good})[0] == 299
    wrong = (
        "",
        TOKEN,
        "Bearer",
        "Bearer ",
        f"Bearer {TOKEN}x",
        f"Bearer {TOKEN[:-1]}",
        "Basic x",
        "Basic e",
        "Basic é",
    )
    for bad in wrong:
        assert asked(GOOD | {"authorization": bad}) == (
            401,
            "the token is missing or wrong: send it in the header Authorization, as Bearer TOKEN",
        )
    assert asked({"host": "localhost"})[0] == 401
    assert asked({"host": "localhost"}, token=None)[0] == 299
    assert asked({"host": "localhost"}, "/v1/health")[0] == 299
    assert asked({"host": "localhost"}, "/v1/health/../jobs")[0] == 401


def test_a_long_body_is_refused_before_it_comes() -> None:
    assert asked(GOOD | {"content-length": str(257 * 10**6)})[0] == 413
    assert asked(GOOD | {"content-length": "9" * 400})[0] == 413


def test_the_service_accepts_any_axes_too(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}\n")
    with running(tmp_path / "store", "--host", "0.0.0.0", "--token-file", str(file), token=TOKEN) as server:
        server.url = server.url.replace("0.0.0.0", "127.0.0.1")
        for address, status in (
            ("/v1/jobs", 401),
            ("/docs", 401),
            ("/v1/openapi.json", 401),
            ("/v1/health", 200),
        ):
            assert server.send("GET", address, headers={"Authorization": ""}).status == status
        assert server.get("/v1/jobs").status == 200
        with pytest.raises(
            InputError, match=r"^the token is missing or wrong: give the service's by --token-"
        ):
            Client(server.url).plan("G1 X1 F9\n", "mill")
        assert server.send("GET", "/v1/jobs", headers={"Host": "evil.example"}).status == 403
        assert server.send("GET", "/v1/jobs", headers={"Origin": "http://evil.example"}).status == 403
        answer = server.send("OPTIONS", "/v1/jobs", headers={"Access-Control-Request-Method": "POST"})
        assert "access-control-allow-origin" not in answer.headers


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (
            ["--host", "0.0.0.0"],
            "0.0.0.0 can be reached from other computers and the service has no token: give",
        ),
        (
            ["--host", "::"],
            ":: can be reached from other computers and the service has no token: give --token",
        ),
        (
            ["--host", "planner.shop"],
            "planner.shop can be reached from other computers and the service has no",
        ),
        (["--token-file", "none"], "the token file none cannot be read (No such file or directory): give"),
        (
            ["--token-file", "short"],
            "short: the token has fewer than 16 characters, more than 4096, or a space: make one by `openssl",
        ),
        (
            ["--host", "192.0.2.1", "--token-file", "good"],
            "the service cannot listen on 192.0.2.1, port 8000 (",
        ),
        (
            ["--store", "short"],
            "the store short cannot be used (File exists): choose another folder with --store",
        ),
    ],
)
def test_it_does_not_begin_where_it_must_not(
    options: list[str],
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "short").write_text("short")
    (tmp_path / "good").write_text(TOKEN)
    port = ["--port", "8000" if "192.0.2.1" in options else "0"]
    assert main(["serve", *port, *options]) == 2
    assert capsys.readouterr().err.startswith(f"error: {sentence}")
