"""Work that runs beside other work, and its progress listener."""

from concurrent.futures import Future
from threading import Event

import pytest

from feedplan.progress import Listener, beside


def test_work_beside_a_block_is_done_at_its_end() -> None:
    done = Event()

    def work(listener: Listener) -> int:
        done.wait()
        listener(1.0)
        return 7

    with beside(work) as result:
        done.set()
    assert result.result() == 7


def test_an_error_in_the_block_ends_the_work_beside_it() -> None:
    told: list[float] = []
    kept: list[Future[None]] = []

    def work(listener: Listener) -> None:
        while len(told) < 1_000_000:
            listener(0.0)
            told.append(0.0)

    def interrupted() -> None:
        with beside(work) as result:
            kept.append(result)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert isinstance(kept[0].exception(), RuntimeError)
    assert len(told) < 1_000_000
