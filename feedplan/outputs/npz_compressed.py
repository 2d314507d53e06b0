"""Setpoints as compressed npz: smaller and slower to write than npz; reading loads the whole file."""

from __future__ import annotations

import shutil
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path as FilePath

from feedplan.outputs import Add, Header, npz

FILE = npz.FILE
ROWS = npz.ROWS
load = npz.load

_BYTES_AT_ONCE = 1 << 20


@contextmanager
def writer(file: FilePath, header: Header, count: int) -> Iterator[Add]:
    """Writes an npz file, then compresses it member by member."""
    with tempfile.TemporaryDirectory(dir=file.parent) as beside:
        whole = FilePath(beside) / FILE
        with npz.writer(whole, header, count) as add:
            yield add
        with zipfile.ZipFile(whole) as plain, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as packed:
            for info in plain.infolist():
                # A large member gets 64-bit fields only if its size is known.
                head = zipfile.ZipInfo(info.filename)
                head.compress_type, head.file_size = zipfile.ZIP_DEFLATED, info.file_size
                with plain.open(info) as source, packed.open(head, "w") as target:
                    shutil.copyfileobj(source, target, _BYTES_AT_ONCE)
