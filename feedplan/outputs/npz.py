"""Setpoints as NumPy's npz: `t`, `position`, `velocity`, `acceleration`, `jerk`, `line`, `axes`, and single
numbers `format` and `period` [s]; `units` are the units of the axes, such as mm or deg.

`events` are records of `time` [s], `line`, `kind`, `channel`, `value`, `stops` and `text`, the index of
the text in `bytes(event_texts).decode().split("\n")`.

The arrays are not compressed, so that they can be mapped into memory instead of read.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feedplan.errors import InputError
from feedplan.outputs import FORMAT, QUANTITIES, SETPOINTS, Add, Header, SetpointFile
from feedplan.outputs._arrays import chunk_of
from feedplan.outputs._events import from_records, to_records
from feedplan.outputs._zip import NpyArchive
from feedplan.progress import Listener, tell
from feedplan.setpoints import SetpointChunk

FILE = "setpoints.npz"
ROWS = SETPOINTS

# A file is refused if its arrays have more than 100 times its own bytes, and more than 2^28 bytes: it would
# fill the memory, while compressed setpoints have about a third of their size.
_DENSEST, _SMALL = 100, 1 << 28


@contextmanager
def writer(file: FilePath, header: Header, count: int) -> Iterator[Add]:
    """Writes `count` setpoints in one pass; only one chunk is in memory."""
    double, integer = np.dtype("<f8"), np.dtype("<i4")
    records, texts = to_records(header.events)
    common: dict[str, NDArray[Any]] = {
        "format": np.array(FORMAT, integer),
        "period": np.array(header.period, double),
        "axes": np.array(header.axes, np.str_),
        "units": np.array(header.units, np.str_),
        "events": records,
        "event_texts": texts,
    }
    arrays: dict[str, tuple[tuple[int, ...], np.dtype[Any]]] = {
        "t": ((count,), double),
        **{name: ((count, len(header.axes)), double) for name in QUANTITIES},
        "line": ((count,), integer),
        **{name: (array.shape, array.dtype) for name, array in common.items()},
    }
    with file.open("wb") as stream:
        archive = NpyArchive(stream, arrays)
        for name, array in common.items():
            archive.append(name, array)

        def add(chunk: SetpointChunk) -> None:
            for name in ("t", *QUANTITIES, "line"):
                archive.append(name, getattr(chunk, name))

        yield add
        archive.close()


def load(file: FilePath, progress: Listener | None = None) -> SetpointFile:
    """The setpoints of an npz file; arrays that are not compressed stay on disk until they are used."""
    try:
        with zipfile.ZipFile(file) as archive:
            members = [info for info in archive.infolist() if info.filename.endswith(".npy")]
            size, packed = sum(info.file_size for info in members), file.stat().st_size
            if size > max(_SMALL, _DENSEST * packed):
                raise ValueError(f"its {packed} bytes claim to hold {size}")
            arrays = {info.filename.removesuffix(".npy"): _member(archive, info, file) for info in members}
    except (OSError, InputError):
        raise
    except Exception as error:  # zipfile and numpy raise many classes of errors for damaged files
        raise InputError(f"{file} is not a whole npz file ({error}): plan again") from None
    if "events" in arrays:
        texts = arrays.get("event_texts", np.empty(0, np.uint8))
        arrays["events"] = from_records(arrays["events"], texts, file)
    tell(progress, 1.0)
    return chunk_of(arrays, file)


def _member(archive: zipfile.ZipFile, info: zipfile.ZipInfo, file: FilePath) -> Any:
    with archive.open(info) as stream:
        version = np.lib.format.read_magic(stream)
        read_head = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        if version not in read_head:
            raise ValueError(f"{info.filename} has the unknown npy version {version}")
        shape, fortran_order, dtype = read_head[version](stream)
        head = stream.tell()
        if dtype.hasobject or fortran_order:
            raise ValueError(f"{info.filename} holds {dtype}, not plain rows of numbers")
        count = math.prod(shape)
        if count * dtype.itemsize != info.file_size - head:
            raise ValueError(
                f"{info.filename} has {info.file_size - head} bytes for {count} values of {dtype}"
            )
        if info.compress_type != zipfile.ZIP_STORED or dtype.kind not in "fiu":
            return np.frombuffer(stream.read(), dtype).reshape(shape)
    with file.open("rb") as stored:
        stored.seek(info.header_offset + 26)
        lengths = np.frombuffer(stored.read(4), dtype="<u2")
    start = info.header_offset + 30 + int(lengths.sum()) + head
    if count == 0 or start % dtype.itemsize:  # arrays of other writers may be unaligned
        return np.fromfile(file, dtype, count, offset=start).reshape(shape)
    return np.memmap(file, dtype=dtype, mode="r", offset=start, shape=shape)
