"""How far work is: one number that rises from 0 to 1, told by who does the work.

Who listens may raise to end it: the work stops within a tenth of a second or so, wherever it is, and what was
raised goes on to who asked for the work.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

Listener = Callable[[float], None]
# The same of a work in stages, with the name of the stage.
Progress = Callable[[str, float], None]


def of_stage(progress: Progress | None, stage: str) -> Listener | None:
    """Who is told of one stage; None where nobody is."""
    return None if progress is None else partial(progress, stage)


def tell(whole: Listener | None, done: float) -> None:
    """Tells who listens, if anybody does."""
    if whole is not None:
        whole(done)


def part(whole: Listener | None, start: float, end: float) -> Listener | None:
    """Who is told of the part of some work from `start` to `end`; None where nobody is."""
    if whole is None:
        return None
    return lambda done: whole(start + (end - start) * done)
