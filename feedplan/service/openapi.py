"""Adds to the OpenAPI document what FastAPI cannot derive from the code: forms, problems and examples."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from fastapi import FastAPI

from feedplan.service.answers import Problem
from feedplan.service.refusals import MEDIA_TYPE
from feedplan.service.requests import JobRequest, PlanRequest

DESCRIPTION = """\
Time-optimal feed planning for CNC part programs. Send a program and a machine to `POST /v1/jobs`; follow the
events of the job in the answer until it is done; its results are below its address.

Millimetres, degrees and seconds throughout. Errors are problems (RFC 9457) with `file`, `line`, `limit` and
`remedy`. If the service has a token, send it as `Authorization: Bearer TOKEN`.
"""
BINARY = {"type": "string", "format": "binary"}
EVENTS: dict[str, Any] = {
    "example": 'id: 3\nevent: progress\ndata: {"stage": "plan", "part": 0.5, "done": 0.42}\n\n',
}
# The guard may answer any request with these.
_ALWAYS = (401, 403, 408, 413)
_PROGRAM = "G21 G90 G64 P0.01\nF1200\nG1 X10 Y5\nX20 Y0\nM2\n"
_EXAMPLE = {
    "name": "part.ngc",
    "program": _PROGRAM,
    "machine": "mill",
    "method": "jerk-limited",
    "options": {"tolerance": 0.02},
}
_TEXT = {"type": "string"}
# The fields of a form are texts, with the same descriptions as in JSON.
_FIELDS = {
    name: {**_TEXT, "description": own.description} if own.description else _TEXT
    for name, own in PlanRequest.model_fields.items()
}
SUBMISSION: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "application/json": {
                "schema": {"$ref": "#/components/schemas/JobRequest"},
                "examples": {
                    "a program": {"value": _EXAMPLE},
                    "a path": {
                        "value": {
                            "program": {
                                "feed": 80.0,
                                "curves": [{"degree": 2, "control_points": [[0, 0], [10, 0], [10, 10]]}],
                            },
                            "machine": "mill",
                        }
                    },
                },
            },
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "required": ["program"],
                    "additionalProperties": False,
                    "properties": {
                        "program": {
                            **BINARY,
                            "description": "The program as a file; the job gets the file's name",
                        },
                        **_FIELDS,
                        "options": {**_TEXT, "description": "The options as JSON"},
                    },
                },
                "example": {"program": _PROGRAM, "machine": "mill", "options": '{"tolerance": 0.02}'},
            },
        },
    }
}

MACHINE: dict[str, Any] = {
    "requestBody": {
        "content": {
            "application/json": {
                "examples": {
                    "a limit": {"value": {"machine": "mill", "limits": {"X": {"max_velocity": 200.0}}}}
                }
            }
        }
    }
}


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Documents the answers of these statuses as problems."""
    return {status: {"model": Problem} for status in statuses}


def content(media_type: str, schema: dict[str, Any], told: str) -> dict[str, Any]:
    """Documents an answer that is not JSON of a model."""
    return {"content": {media_type: {"schema": schema}}, "description": told}


def contents(media_types: Iterable[str]) -> dict[str, Any]:
    """Documents an answer that is a file of one of these types."""
    return {
        "content": {
            media_type: {"schema": {"type": "object"} if media_type == "application/json" else BINARY}
            for media_type in sorted(media_types)
        },
        "description": "A file",
    }


def complete(app: FastAPI) -> None:
    """Sets the media type of problems, and adds the guard's answers to every operation."""
    generate = app.openapi

    def document() -> dict[str, Any]:
        if app.openapi_schema:
            return app.openapi_schema
        found = generate()
        schemas = found["components"]["schemas"]
        model = JobRequest.model_json_schema(ref_template="#/components/schemas/{model}")
        schemas |= model.pop("$defs")
        schemas["JobRequest"] = model
        for name in ("HTTPValidationError", "ValidationError"):
            schemas.pop(name, None)
        problem = {MEDIA_TYPE: {"schema": {"$ref": "#/components/schemas/Problem"}}}
        for operations in found["paths"].values():
            for operation in operations.values():
                told = operation["responses"]
                for status in {*map(str, _ALWAYS), *(own for own in told if own >= "400")}:
                    text = told.get(status, {}).get("description") or "A problem"
                    told[status] = {"description": text, "content": problem}
                operation["responses"] = dict(sorted(told.items()))
        found["components"]["securitySchemes"] = {"token": {"type": "http", "scheme": "bearer"}}
        found["security"] = [{"token": []}, {}]
        app.openapi_schema = found
        return found

    app.openapi = document  # type: ignore[method-assign]
