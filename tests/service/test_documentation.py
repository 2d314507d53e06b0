"""The service's documentation: answers agree with the OpenAPI document, and its page needs no network."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import fields
from html.parser import HTMLParser
from importlib.util import find_spec

import pytest

from feedplan.planners import methods, options_of
from feedplan.planning import OF_ALL_METHODS
from feedplan.program.read import Reading
from feedplan.service.limits import Limits
from feedplan.service.requests import Options
from tests.campaign import EXAMPLES
from tests.service.servers import Server

ADDRESSES = {
    "/v1/jobs": {"get", "post"},
    "/v1/jobs/{job}": {"get", "delete"},
    **{
        f"/v1/jobs/{{job}}/{part}": {"get"}
        for part in ("events", "result", "audit", "setpoints", "program", "report", "drawing")
    },
    "/v1/jobs/{job}/cancel": {"post"},
    "/v1/machines": {"get", "post"},
    **{f"/v1/{name}": {"get"} for name in ("compare", "machines/{name}", "controllers", "methods", "health")},
}


def test_every_address_is_documented_with_its_problems(server: Server) -> None:
    document = server.get("/v1/openapi.json").json
    assert {address: set(own) for address, own in document["paths"].items()} == ADDRESSES
    schemas = document["components"]["schemas"]
    for operations in document["paths"].values():
        for operation in operations.values():
            assert operation["summary"]
            assert list(operation["responses"]) == sorted(operation["responses"])
            for status, told in operation["responses"].items():
                if status >= "400":
                    assert list(told["content"]) == ["application/problem+json"]
    used = set(re.findall(r"#/components/schemas/(\w+)", str(document)))
    assert used <= set(schemas)
    submission = document["paths"]["/v1/jobs"]["post"]["requestBody"]["content"]
    assert set(submission) == {"application/json", "multipart/form-data"}
    sent = document["paths"]["/v1/machines"]["post"]["requestBody"]["content"]["application/json"]
    for example in sent["examples"].values():
        body = json.dumps(example["value"]).encode()
        answer = server.send("POST", "/v1/machines", body, {"Content-Type": "application/json"})
        assert answer.json["axes"][0]["max_velocity"] == example["value"]["limits"]["X"]["max_velocity"]
    for example in submission["application/json"]["examples"].values():
        body = json.dumps(example["value"]).encode()
        answer = server.send("POST", "/v1/jobs", body, {"Content-Type": "application/json"})
        assert server.wait(answer.json["id"])["state"] == "done"


def test_the_page_has_all_sections_and_loads_nothing(server: Server) -> None:
    assert b'href="/docs"' in server.get("/").content
    answer = server.get("/docs")
    assert answer.headers["content-security-policy"].startswith("default-src 'none'")
    text = answer.content.decode()
    found: list[tuple[str, str | None]] = []

    class Links(HTMLParser):
        def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
            assert tag not in ("script", "link", "img", "iframe")
            found.extend((name, value) for name, value in attrs if name in ("href", "src"))

    Links().feed(text)
    assert {value for _, value in found if value and not value.startswith("#")} == {"/v1/openapi.json"}
    anchors = set(re.findall(r'id="(\w+)"', text))
    assert {value[1:] for _, value in found if value and value.startswith("#")} <= anchors
    for address in ADDRESSES:
        assert address in text


def test_a_body_that_is_not_text_has_a_documented_answer(server: Server) -> None:
    for address in ("/v1/machines", "/v1/jobs"):
        answer = server.send("POST", address, b"e\xedg\x07\x80", {"Content-Type": "application/json"})
        assert answer.status in (400, 422)


def test_the_options_are_those_that_a_plan_takes() -> None:
    kept_here = {"reading", "progress", "elsewhere"}
    of_reading = set(Reading.__annotations__) - {"tool_table", "subprograms", "max_moves"}
    of_methods = {name for method in methods() for name in options_of(method)}
    assert set(Options.model_fields) == (set(OF_ALL_METHODS) - kept_here) | of_reading | of_methods


def test_the_limits_are_of_plain_types() -> None:
    assert all(type(own.default) in (int, float) and own.metadata["unit"] for own in fields(Limits))


@pytest.mark.skipif(not (EXAMPLES and find_spec("schemathesis")), reason="campaign with schemathesis")
def test_schemathesis_finds_no_answer_that_is_not_documented(server: Server) -> None:
    checks = "not_a_server_error,status_code_conformance,content_type_conformance,response_schema_conformance"
    command = ["-m", "schemathesis.cli", "run", f"{server.url}/v1/openapi.json", "--checks", checks]
    done = subprocess.run(
        [sys.executable, *command, "--max-examples", EXAMPLES or "10"],
        capture_output=True,
        text=True,
        timeout=3000,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]
