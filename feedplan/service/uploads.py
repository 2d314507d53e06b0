"""Receives a request to plan: the program is written to a file, machine and options are kept in memory."""

from __future__ import annotations

import asyncio
import hashlib
import io
import json
import os
import secrets
from contextlib import suppress
from pathlib import Path as FilePath
from typing import IO, Any

import python_multipart  # noqa: F401 (forms are read by it)
from starlette.datastructures import FormData, UploadFile
from starlette.requests import Request

from feedplan.service.limits import Limits
from feedplan.service.refusals import INPUT, LIMIT, MEDIA, PROGRAM, Refusal, over
from feedplan.service.requests import JobRequest, Options, PlanRequest, parsed
from feedplan.service.store import Upload

# The greatest length of a text other than the program [bytes].
LONGEST_TEXT = 1 << 20
_PART = 1 << 20
_FIELDS = tuple(PlanRequest.model_fields)


async def received(request: Request, new: FilePath, limits: Limits) -> tuple[Upload, PlanRequest]:
    """The program, in a file below `new`, and the rest of the request. Raises Refusal."""
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind == "application/json":
        body = await request.body()
        return await asyncio.to_thread(_of_json, body, new, limits)
    if kind == "multipart/form-data":
        async with request.form(max_files=3, max_fields=8, max_part_size=LONGEST_TEXT) as form:
            return await asyncio.to_thread(_of_form, form, new, limits)
    raise Refusal(MEDIA, "the request is of another type: send application/json or multipart/form-data")


def _of_json(body: bytes, new: FilePath, limits: Limits) -> tuple[Upload, PlanRequest]:
    asked: JobRequest = parsed(JobRequest, body)
    if isinstance(asked.program, str):
        content, name = asked.program.encode(), asked.name
    else:
        content, name = _path_file(asked.program), asked.name or "path.json"
    asked = asked.model_copy(update={"name": name, "program": ""})
    return _stored(io.BytesIO(content), new, limits), asked


def _path_file(table: dict[str, Any]) -> bytes:
    try:
        return json.dumps(table).encode()
    except (ValueError, RecursionError):  # ValueError also for integers of thousands of digits
        raise Refusal(INPUT, "program: it has numbers that no path file has: give finite ones") from None


def _of_form(form: FormData, new: FilePath, limits: Limits) -> tuple[Upload, PlanRequest]:
    fields: dict[str, Any] = {}
    program: UploadFile | str | None = None
    for field, value in form.multi_items():
        if field == "program" and program is None:
            program = value
        elif field in _FIELDS and field not in fields:
            fields[field] = _text(field, value)
        else:
            known = ", ".join(("program", *_FIELDS))
            raise Refusal(INPUT, f"the form has {field[:40]!r} too often or wrongly: give {known} once each")
    if program is None:
        raise Refusal(INPUT, "the form has no program: give one, as a file or a text")
    stream: IO[bytes] = io.BytesIO(program.encode()) if isinstance(program, str) else program.file
    if not isinstance(program, str):
        fields.setdefault("name", (program.filename or "")[-120:])
    given = fields.pop("options", None)
    options = parsed(Options, given, "options") if given else Options()
    asked: PlanRequest = parsed(PlanRequest, json.dumps(fields))
    return _stored(stream, new, limits), asked.model_copy(update={"options": options})


def _text(field: str, value: UploadFile | str) -> str:
    if isinstance(value, str):
        return value
    content = value.file.read(LONGEST_TEXT + 1)
    if len(content) > LONGEST_TEXT:
        raise Refusal(INPUT, f"{field} has more than {LONGEST_TEXT} bytes: give a shorter one")
    with suppress(UnicodeDecodeError):
        return content.decode()
    raise Refusal(INPUT, f"{field} is no text in UTF-8: save it so")


def _stored(stream: IO[bytes], new: FilePath, limits: Limits) -> Upload:
    """Writes the content to a file; computes its hash and counts its lines at the same time."""
    file = new / secrets.token_hex(16)
    sha256, size, lines, last = hashlib.sha256(), 0, 0, b"\n"
    try:
        with file.open("wb") as target:
            while part := stream.read(_PART):
                target.write(part)
                sha256.update(part)
                size += len(part)
                lines += part.count(b"\n") if b"\n" in part else part.count(b"\r")
                last = part[-1:]
                if lines > limits.max_blocks:
                    raise over(
                        limits,
                        LIMIT,
                        f"the program has more lines than the {limits.max_blocks} of max_blocks: split it",
                    )
        if size == 0:
            raise Refusal(PROGRAM, "the program is empty: give a part program")
    except BaseException:
        with suppress(OSError):
            os.unlink(file)
        raise
    return Upload(file, sha256.hexdigest(), size, lines + (last not in b"\r\n"))
