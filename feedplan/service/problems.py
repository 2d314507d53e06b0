"""Turns every error during a request into an answer that is a problem (RFC 9457)."""

from __future__ import annotations

import sqlite3

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

    async def answer(_: Request, error: Exception) -> Response:
        if isinstance(error, ClientDisconnect):
            return Response(status_code=400)  # the client is gone
        refusal = _refusal(error)
        headers = {"Retry-After": "5"} if refusal.kind.status == 429 else {}
        headers.update(getattr(error, "headers", None) or {})
        return Response(refusal.text(), refusal.kind.status, headers, MEDIA_TYPE)

    for kind in (
        *(Refusal, FeedplanError, RequestValidationError, HTTPException, ClientDisconnect),
        *(OSError, sqlite3.OperationalError, Exception),
    ):
        app.add_exception_handler(kind, answer)


def _refusal(error: Exception) -> Refusal:
    """An error as a problem."""
    if isinstance(error, Refusal):
        return error
    if isinstance(error, FeedplanError):
        return refusal_of(error)
    if isinstance(error, RequestValidationError):
        return Refusal(INPUT, sentence_of(error.errors()[0]))
    if isinstance(error, HTTPException):
        if error.status_code == 404:
            return Refusal(UNKNOWN, "there is no such address: /docs tells those there are")
        if error.status_code == 405:
            return Refusal(METHOD, "the address does not take this method: /docs tells those it does")
        kind = Kind("input", error.status_code, INPUT.title)
        return Refusal(kind, f"{str(error.detail)[:200].lower().rstrip('.')}: correct the request")
    if isinstance(error, FileNotFoundError):
        return Refusal(UNKNOWN, "the job was deleted meanwhile: send it again")
    if isinstance(error, (OSError, sqlite3.OperationalError)):
        return Refusal(DISK, "the disk of the service is full or broken: tell its operator")
    said = "this is a defect in feedplan, the service's messages have more: please report it"
    return Refusal(DEFECT, said)
