"""Sends requests to a service over HTTP: JSON, files and events; its problems become errors of feedplan.

It needs only `http.client`, which is slow to import and therefore imported with the first request.
"""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from http import HTTPStatus
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode, urlsplit

from feedplan.arguments import is_text, refuse
from feedplan.errors import (
    FeedplanError,
    InfeasibleError,
    InputError,
    MachineError,
    MissingPackageError,
    ProgramError,
    SolverError,
)

if TYPE_CHECKING:
    from http.client import HTTPConnection, HTTPResponse

# The error for each type of problem (the part after its last colon).
_ERRORS: Mapping[str, type[FeedplanError]] = {
    own.kind: own for own in (ProgramError, MachineError, InfeasibleError, SolverError, MissingPackageError)
}
# The pause before each attempt to send a request [s]; it is sent again if the connection breaks.
_PAUSES = (0.0, 0.2, 1.0)
_PART = 1 << 20


class Transport:
    """Sends requests to the service at an address, with its `token`; `timeout` [s] is the longest wait for an
    answer."""

    def __init__(self, url: str, token: str | None, timeout: float) -> None:
        parts = urlsplit(url if is_text(url) else "")
        good = parts.scheme in ("http", "https") and parts.hostname and not parts.query + parts.fragment
        try:
            port = parts.port
        except ValueError:
            good = False
        if not good:
            raise refuse("the address of the service", url, "one such as http://127.0.0.1:8000")
        if token is not None and not (is_text(token) and token.isascii() and token.isprintable()):
            raise refuse("the token", "***", "a text of letters and digits, or None")
        self.url, self._token, self._timeout = url, token, timeout
        self._secure, self._host, self._port = parts.scheme == "https", str(parts.hostname), port
        self._base = parts.path.rstrip("/")

    def json(self, method: str, address: str, query: Any = None, **more: Any) -> tuple[int, Any]:
        """The status and the answer, None without content. A problem raises its error."""
        with self.request(method, address, query, **more) as response:
            content = response.read()
            return response.status, json.loads(content) if content else None

    def download(self, address: str, file: FilePath, query: Any = None) -> None:
        """Stores the answer of an address in a file."""
        with self.request("GET", address, query) as response, file.open("wb") as target:
            shutil.copyfileobj(response, target, _PART)

    @contextmanager
    def request(
        self,
        method: str,
        address: str,
        query: Any = None,
        *,
        body: bytes | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> Iterator[HTTPResponse]:
        """The answer to a request, which is sent again if the connection breaks. A problem raises its
        error."""
        import http.client

        target = self._base + address + (f"?{urlencode(query, doseq=True)}" if query else "")
        own = {} if self._token is None else {"Authorization": f"Bearer {self._token}"}
        for pause in _PAUSES:
            time.sleep(pause)
            connection = self._connection()
            try:
                response = _answer(connection, method, target, body, {**own, **(headers or {})})
                break
            except (OSError, http.client.HTTPException) as error:
                connection.close()
                broken = error
        else:
            said = getattr(broken, "strerror", None) or str(broken) or type(broken).__name__
            raise InputError(
                f"the service at {self.url} cannot be reached ({said.lower()}): "
                "start it by `feedplan serve`, or correct the address"
            ) from None
        try:
            if response.status >= 400:
                raise _error(response)
            yield response
        finally:
            connection.close()

    def _connection(self) -> HTTPConnection:
        from http.client import HTTPConnection, HTTPSConnection

        kind = HTTPSConnection if self._secure else HTTPConnection
        return kind(self._host, self._port, timeout=self._timeout)

    def events(self, address: str) -> Iterator[tuple[str, dict[str, Any]]]:
        """Kind and data of each event at an address until the stream ends; after a broken connection the
        stream continues with the next event."""
        last, silent = "0", 0
        while silent < len(_PAUSES):
            with suppress(OSError), self.request("GET", address, headers={"Last-Event-ID": last}) as response:
                if response.status == 204:
                    return
                event: dict[str, str] = {}
                for raw in response:
                    line = raw.decode().rstrip("\n")
                    if line:
                        name, _, value = line.partition(":")
                        event[name] = value.removeprefix(" ")
                    elif "data" in event:
                        last, silent = event["id"], 0
                        yield event["event"], json.loads(event["data"])
                        event = {}
                    else:
                        event = {}
            # Counts attempts without an event: a stream that has ended has no more events.
            silent += 1


def _answer(
    connection: HTTPConnection, method: str, target: str, body: bytes | None, headers: Mapping[str, str]
) -> HTTPResponse:
    """The answer to a request. A service that refuses a request answers before it has received all of it, and
    closes the connection: sending then fails, but the answer can be read."""
    from http.client import HTTPException

    try:
        connection.request(method, target, body, headers)
    except (BrokenPipeError, ConnectionResetError):
        with suppress(OSError, HTTPException):
            return connection.getresponse()
        raise
    return connection.getresponse()


def _error(response: HTTPResponse) -> FeedplanError:
    """The error for an answer that is a problem."""
    try:
        problem = json.loads(response.read())
        kind, detail, line = problem["type"].rpartition(":")[2], str(problem["detail"]), problem["line"]
    except (ValueError, KeyError, TypeError, AttributeError, OSError):
        return InputError(
            f"the address answers with the status {response.status} and no word of feedplan: "
            "is a feedplan service there?"
        )
    if response.status == HTTPStatus.UNAUTHORIZED:
        detail = (
            "the token is missing or wrong: give the service's by --token-file, or Client(address, token)"
        )
    return error_of(kind, detail, line)


def error_of(kind: str, detail: str, line: int | None) -> FeedplanError:
    """The error for a kind of problem, with its sentence and the line of the program."""
    return _ERRORS.get(kind, InputError)(detail, line)


def form(fields: Mapping[str, str], program: bytes, name: str) -> tuple[bytes, str]:
    """A multipart form with a program, and its content type."""
    boundary = f"feedplan-{os.urandom(16).hex()}"
    parts = [
        f'--{boundary}\r\nContent-Disposition: form-data; name="{key}"\r\n\r\n{value}\r\n'.encode()
        for key, value in fields.items()
    ]
    safe = "".join(letter if letter.isprintable() and letter not in '"\\' else "_" for letter in name)
    head = f'Content-Disposition: form-data; name="program"; filename="{safe}"\r\n'
    parts.append(f"--{boundary}\r\n{head}Content-Type: application/octet-stream\r\n\r\n".encode())
    parts += [program, f"\r\n--{boundary}--\r\n".encode()]
    return b"".join(parts), f"multipart/form-data; boundary={boundary}"
