"""Checks every request before its body is read.

- `Host` must be a name of this service; a foreign page whose name was pointed at the service (DNS rebinding)
  sends another name. Numeric addresses are allowed, because a foreign page cannot have them.
- `Origin`, which browsers send with requests of a page, must be the service itself.
- The token, if there is one, is sent as `Authorization: Bearer TOKEN`, or as the password of Basic
  authentication, for which browsers ask their users.
- The body has at most `max_upload`, and must arrive within `max_upload_time`.

A HEAD request is answered as GET, without the content.
"""

from __future__ import annotations

import asyncio
import base64
import binascii
import hmac
from collections.abc import Awaitable, Callable, Collection, MutableMapping
from typing import Any

from feedplan.jobs.address import is_address
from feedplan.service import front
from feedplan.service.limits import MB, Limits
from feedplan.service.refusals import FOREIGN, MEDIA_TYPE, TOKEN, TOO_LARGE, TOO_SLOW, Refusal, over

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

# Addresses without a token: the health of the service, and the page, which asks for the token.
OPEN = ("/v1/health", *front.ADDRESSES)
# No answer is cached, its type is not guessed, and no other page embeds it.
_HEADERS = (
    (b"cache-control", b"no-store"),
    (b"x-content-type-options", b"nosniff"),
    (b"x-frame-options", b"SAMEORIGIN"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
)


class Guard:
    """An ASGI application around `app`; `hosts` are the names of the service, `token` is its token or
    None."""

    def __init__(self, app: App, limits: Limits, hosts: Collection[str], token: str | None) -> None:
        self._app, self._limits = app, limits
        self._hosts = {name.lower() for name in hosts}
        self._token = token

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            return  # the server refuses WebSocket connections
        begun = ended = False
        is_head = scope["method"] == "HEAD"

        async def answer(message: Message) -> None:
            nonlocal begun, ended
            if message["type"] == "http.response.start":
                begun = True
                present = {name for name, _ in message["headers"]}
                own = [header for header in _HEADERS if header[0] not in present]
                message["headers"] = [*message["headers"], *own]
            elif is_head:
                # The answer ends with its headers: a stream of events sees that its client is gone.
                if ended:
                    return
                message, ended = {"type": "http.response.body"}, True
            await send(message)

        try:
            headers = _single(scope["headers"])
            self._require_place(scope, headers)
            self._require_token(scope, headers)
            self._require_length(headers)
            asked = {**scope, "method": "GET"} if is_head else scope
            await self._app(asked, self._counted(receive), answer)
        except Refusal as refusal:
            if not begun:
                await _refuse(refusal, answer)

    def _require_place(self, scope: Message, headers: dict[bytes, bytes]) -> None:
        host = headers.get(b"host", b"").decode("latin-1")
        name = _without_port(host)
        if not (is_address(name) or name.lower() in self._hosts):
            known = ", ".join(sorted(self._hosts))
            raise Refusal(
                FOREIGN,
                f"the service is not known as {name[:60]!r}: use {known}, or add a name by --allow-host",
            )
        origin = headers.get(b"origin")
        own = f"{scope['scheme']}://{host}".lower()
        if origin is not None and origin.decode("latin-1").lower() != own:
            raise Refusal(FOREIGN, f"pages of other places may not use the service: open {own[:80]}")

    def _require_token(self, scope: Message, headers: dict[bytes, bytes]) -> None:
        if self._token is None or scope["path"] in OPEN:
            return
        scheme, _, given = headers.get(b"authorization", b"").partition(b" ")
        if scheme.lower() == b"basic":
            try:
                given = base64.b64decode(given, validate=True).partition(b":")[2]
            except binascii.Error:
                given = b""
        elif scheme.lower() != b"bearer":
            given = b""
        if not hmac.compare_digest(given.strip(), self._token.encode()):
            raise Refusal(
                TOKEN, "the token is missing or wrong: send it in the header Authorization, as Bearer TOKEN"
            )

    def _require_length(self, headers: dict[bytes, bytes]) -> None:
        length = headers.get(b"content-length", b"0")
        if length.isdigit() and int(length[:19]) > self._limits.max_upload * MB:
            raise self._too_large()

    def _too_large(self) -> Refusal:
        most = self._limits.max_upload
        said = f"the request has more than {most:g} MB, which is max_upload: split the program"
        return over(self._limits, TOO_LARGE, said)

    def _counted(self, receive: Receive) -> Receive:
        """Passes the messages on; raises Refusal if the body is too long or too late."""
        received, whole = 0, False
        end: float | None = None

        async def part() -> Message:
            nonlocal received, whole, end
            if whole:  # after the whole body only the end of the connection can follow
                return await receive()
            loop = asyncio.get_running_loop()
            end = loop.time() + self._limits.max_upload_time if end is None else end
            try:
                message = await asyncio.wait_for(receive(), max(end - loop.time(), 0.0))
            except asyncio.TimeoutError:
                said = (
                    f"the request took longer than {self._limits.max_upload_time:g} s, which is "
                    "max_upload_time: send it on a quicker line"
                )
                raise over(self._limits, TOO_SLOW, said) from None
            received += len(message.get("body", b""))
            whole = not message.get("more_body", False)
            if received > self._limits.max_upload * MB:
                raise self._too_large()
            return message

        return part


def _single(headers: list[tuple[bytes, bytes]]) -> dict[bytes, bytes]:
    """The headers by name. Raises Refusal if a header that is checked comes twice."""
    found: dict[bytes, bytes] = {}
    for name, value in headers:
        if name in found and name in (b"host", b"origin", b"authorization", b"content-length"):
            raise Refusal(FOREIGN, f"the header {name.decode('latin-1')} comes twice: send it once")
        found[name] = value
    return found


def _without_port(host: str) -> str:
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0]


async def _refuse(refusal: Refusal, send: Send) -> None:
    """Answers with the problem, and closes the connection: the rest of the body is not read."""
    headers = [(b"content-type", MEDIA_TYPE.encode()), (b"connection", b"close")]
    if refusal.kind is TOKEN:
        headers.append((b"www-authenticate", b'Basic realm="feedplan", charset="UTF-8"'))
    body = refusal.text().encode()
    headers.append((b"content-length", str(len(body)).encode()))
    await send({"type": "http.response.start", "status": refusal.kind.status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
