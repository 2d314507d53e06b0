"""Turns every error during a request into an answer that is a problem (RFC 9457)."""

from __future__ import annotations

import sqlite3
from typing import Any

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response

from feedplan.errors import FeedplanError
from feedplan.service.refusals import (
    DEFECT,
    DISK,
    INPUT,
    MEDIA_TYPE,
    METHOD,
    UNKNOWN,
    Kind,
    Refusal,
    refusal_of,
)
from feedplan.service.requests import sentence_of


def add_handlers(app: FastAPI) -> None:
    """Adds an answer for every error; unexpected errors also go to the log of the service."""

    @app.exception_handler(Refusal)
    async def refused(_: Request, refusal: Refusal) -> Response:
        return _problem(refusal)

    @app.exception_handler(FeedplanError)
    async def failed(_: Request, error: FeedplanError) -> Response:
        return _problem(refusal_of(error))

    @app.exception_handler(RequestValidationError)
    async def wrong(_: Request, error: RequestValidationError) -> Response:
        return _problem(Refusal(INPUT, sentence_of(error.errors()[0])))

    @app.exception_handler(HTTPException)
    async def not_there(_: Request, error: HTTPException) -> Response:
        if error.status_code == 404:
            refusal = Refusal(UNKNOWN, "there is no such address: /docs tells those there are")
        elif error.status_code == 405:
            refusal = Refusal(METHOD, "the address does not take this method: /docs tells those it does")
        else:
            kind = Kind("input", error.status_code, INPUT.title)
            refusal = Refusal(kind, f"{str(error.detail)[:200].lower().rstrip('.')}: correct the request")
        return _problem(refusal, error.headers)

    @app.exception_handler(ClientDisconnect)
    async def left(_: Request, error: Exception) -> Response:
        return Response(status_code=400)  # the client is gone

    @app.exception_handler(FileNotFoundError)
    async def gone(_: Request, error: Exception) -> Response:
        return _problem(Refusal(UNKNOWN, "the job was deleted meanwhile: send it again"))

    @app.exception_handler(sqlite3.OperationalError)
    @app.exception_handler(OSError)
    async def broken(_: Request, error: Exception) -> Response:
        return _problem(
            Refusal(DISK, "the disk of the service is full or broken: tell its operator"),
        )

    @app.exception_handler(Exception)
    async def defect(_: Request, error: Exception) -> Response:
        said = "this is a defect in feedplan, the service's messages have more: please report it"
        return _problem(Refusal(DEFECT, said))


def _problem(refusal: Refusal, headers: Any = None) -> Response:
    own = {"Retry-After": "5"} if refusal.kind.status == 429 else {}
    return Response(
        refusal.text(), refusal.kind.status, media_type=MEDIA_TYPE, headers={**own, **(headers or {})}
    )
