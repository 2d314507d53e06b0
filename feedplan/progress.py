"""Progress of a computation: a callback that gets a number rising from 0 to 1.

An exception from the callback ends the computation within about a tenth of a second, in every stage, and is
raised to the caller of the computation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from threading import Event
from typing import TypeVar

T = TypeVar("T")
Listener = Callable[[float], None]
# A callback for a computation in stages; its first argument is the name of the stage.
Progress = Callable[[str, float], None]


def of_stage(progress: Progress | None, stage: str) -> Listener | None:
    """The listener for one stage; None without a listener."""
    return None if progress is None else partial(progress, stage)


def tell(whole: Listener | None, done: float) -> None:
    """Calls the listener, if there is one."""
    if whole is not None:
        whole(done)


def part(whole: Listener | None, start: float, end: float) -> Listener | None:
    """The listener for a part of the work, from `start` to `end` of the whole; None without a listener."""
    if whole is None:
        return None
    return lambda done: whole(start + (end - start) * done)


@contextmanager
def beside(work: Callable[[Listener], T]) -> Iterator[Future[T]]:
    """Does `work` in another thread while the block runs; leaving the block waits for `work`.

    `work` gets a listener. An exception in the block also ends the work, at its next call of the listener.
    """
    unwanted = Event()

    def listen(done: float) -> None:
        if unwanted.is_set():
            raise RuntimeError("the result is not wanted any more")

    with ThreadPoolExecutor(1) as thread:
        try:
            yield thread.submit(work, listen)
        except BaseException:
            unwanted.set()
            raise
