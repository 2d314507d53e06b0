"""The progress of a job as server-sent events; a client that connects again gets the events after the last
one that it had (`Last-Event-ID`).

`state` events have {"state": …}; `progress` events have {"stage": …, "part": …, "done": …}, where `part` of
the stage and `done` of the whole job are from 0 to 1. The stream ends with the job.
"""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import aclosing

from feedplan.service.refusals import Refusal
from feedplan.service.store import ENDED, Store

MEDIA_TYPE = "text/event-stream"
# Longest time without an event [s]: then a comment is sent, so that proxies keep the connection open.
HEARTBEAT = 15.0


class Bell:
    """Wakes the streams that wait for changes of a job; `ring` may be called from any thread."""

    def __init__(self) -> None:
        self._waiting: defaultdict[str, set[asyncio.Event]] = defaultdict(set)
        self._loop: asyncio.AbstractEventLoop | None = None

    def attach(self, loop: asyncio.AbstractEventLoop | None) -> None:
        """Sets the event loop of the streams; None when the application ends."""
        self._loop = loop

    def ring(self, job: str) -> None:
        """Wakes the streams of a job."""
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(self._wake, job)

    def _wake(self, job: str) -> None:
        for event in self._waiting.get(job, ()):
            event.set()

    async def changes(self, job: str) -> AsyncGenerator[bool, None]:
        """Yields at once and after each change of the job; False after HEARTBEAT without a change."""
        event = asyncio.Event()
        self._waiting[job].add(event)
        try:
            yield True
            while True:
                try:
                    await asyncio.wait_for(event.wait(), HEARTBEAT)
                    event.clear()
                    yield True
                except asyncio.TimeoutError:  # noqa: PERF203
                    yield False
        finally:
            self._waiting[job].discard(event)
            if not self._waiting[job]:
                del self._waiting[job]


async def stream(store: Store, bell: Bell, job: str, after: int) -> AsyncIterator[str]:
    """The events of a job after the event `after`, as text, until the job has ended or is deleted."""
    yield "retry: 1000\n\n"
    async with aclosing(bell.changes(job)) as changes:
        async for changed in changes:
            if not changed:
                yield ": still there\n\n"
                continue
            try:
                # The state is read before the events, so that after the end of the job no event is missed.
                state = (await asyncio.to_thread(store.job, job))["state"]
            except Refusal:
                return
            for event in await asyncio.to_thread(store.events, job, after):
                after = event.number
                yield f"id: {event.number}\nevent: {event.kind}\ndata: {event.data}\n\n"
            if state in ENDED:
                return
