"""The memory of writers does not grow with the number of rows."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from feedplan.events import Event, TimedEvents
from feedplan.outputs import Header, format_named
from feedplan.setpoints import SetpointChunk
from tests.outputs.parquet import FORMATS

AXES = ("X", "Y", "Z")


def peak(name: str, chunks: int, folder: Path) -> int:
    """The peak memory of Python, numpy and Arrow while `chunks` chunks are written [bytes]."""
    rows = 500 if name == "json" else 10_000  # measuring memory makes Python slow
    values = np.random.default_rng(1).normal(size=(rows, 3))
    line = np.arange(rows, dtype=np.int32)
    events = TimedEvents.of([Event(0.5 * k, k, "output", 1.0, k % 2, False, "M62 P1") for k in range(50)])
    output = format_named(name)
    arrow = None
    if name == "parquet":
        import pyarrow as arrow
    most = 0
    tracemalloc.start()
    try:
        header = Header(AXES, ("mm",) * 3, 0.001, events)
        with output.writer(folder / output.FILE, header, chunks * rows) as add:
            for k in range(chunks):
                t = (k * rows + np.arange(rows)) * 0.001
                add(SetpointChunk(t, values, values, values, values, line, AXES))
                most = max(most, arrow.total_allocated_bytes() if arrow else 0)
        return tracemalloc.get_traced_memory()[1] + most
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("name", FORMATS)
def test_three_times_the_setpoints_take_the_same_memory(name: str, tmp_path: Path) -> None:
    peak(name, 1, tmp_path)  # imports all that is needed
    short, long = peak(name, 10, tmp_path), peak(name, 30, tmp_path)
    # The 20 additional chunks have 18 MB of numbers, with json 1 MB.
    assert long <= 1.1 * short + 300_000
