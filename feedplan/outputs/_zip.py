"""A zip archive of .npy members that are all filled in one pass over the rows.

The standard library writes one member after the other, which would need one pass over all setpoints for each
member, or all setpoints in memory. Here the sizes are known in advance and nothing is compressed, so the
offset of every member is known at the start; only the checksums are written at the end. Heads and directory
are made by `zipfile`.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

_HEAD_ROOM = 1024  # upper bound of the size of a .npy head [bytes]
_ALIGNMENT = 64
_READABLE = 0o600 << 16  # file permission: owner may read and write


@dataclass
class _Member:
    """A member of the archive; `data` is the offset of its data in the archive, `written` the number of bytes
    of it that are written."""

    entry: zipfile.ZipInfo
    is_large: bool
    dtype: np.dtype[Any]
    data: int
    written: int = 0

    @property
    def head(self) -> bytes:
        """The zip head of the member, which is before its data."""
        return self.entry.FileHeader(zip64=self.is_large)


class NpyArchive:
    """An archive of arrays of these shapes and types; `append` fills them."""

    def __init__(self, file: BinaryIO, arrays: dict[str, tuple[tuple[int, ...], np.dtype[Any]]]) -> None:
        self._file = file
        self._members: dict[str, _Member] = {}
        self._end = 0
        for name, (shape, dtype) in arrays.items():
            body = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
            # An entry without a date has 1 January 1980, so that equal setpoints make equal files.
            entry = zipfile.ZipInfo(f"{name}.npy")
            entry.header_offset, entry.external_attr = self._end, _READABLE
            entry.CRC = entry.file_size = entry.compress_size = 0
            member = _Member(entry, body + _HEAD_ROOM > zipfile.ZIP64_LIMIT, dtype, 0)
            member.data = self._end + len(member.head)
            head = _npy_head(shape, dtype, member.data)
            entry.file_size = entry.compress_size = len(head) + body
            self._members[name] = member
            self._write(member, head)
            self._end = member.data + entry.file_size

    def append(self, name: str, rows: NDArray[Any]) -> None:
        """Appends rows to the array of that name, or sets its number if it is a scalar."""
        member = self._members[name]
        rows = np.ascontiguousarray(rows, dtype=member.dtype)
        if rows.size:
            self._write(member, rows.data.cast("B"))

    def close(self) -> None:
        """Writes the heads with the checksums, then the directory."""
        for name, member in self._members.items():
            if member.written != member.entry.file_size:
                missing = member.entry.file_size - member.written
                raise ValueError(f"{name} lacks {missing} of {member.entry.file_size} bytes")
            self._file.seek(member.entry.header_offset)
            self._file.write(member.head)
        with zipfile.ZipFile(self._file, "w") as archive:
            archive.filelist.extend(member.entry for member in self._members.values())
            archive.start_dir = self._end  # the directory is written there

    def _write(self, member: _Member, data: bytes | memoryview) -> None:
        if member.written + len(data) > member.entry.file_size:
            raise ValueError(f"{member.entry.filename} has more rows than announced")
        self._file.seek(member.data + member.written)
        self._file.write(data)
        member.written += len(data)
        member.entry.CRC = zlib.crc32(data, member.entry.CRC)


def _npy_head(shape: tuple[int, ...], dtype: np.dtype[Any], offset: int) -> bytes:
    """The head of a .npy file at this offset of the archive, padded so that its rows can be mapped."""
    buffer = io.BytesIO()
    header = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(buffer, header)
    head = buffer.getvalue()
    text = head[10:-1] + b" " * (-(offset + len(head)) % _ALIGNMENT) + b"\n"
    return head[:8] + struct.pack("<H", len(text)) + text
