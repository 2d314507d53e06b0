"""A zip archive of .npy members that are all filled in one pass over the rows.

The standard library writes one member after the other: that would need one pass over all setpoints for each
member, or all setpoints in memory. Here the sizes are known beforehand and nothing is compressed, so the
offset of every member is known at the start; only the checksums are written at the end. Format: PKWARE's
APPNOTE 6.3, with 64-bit fields only where a size or an offset needs them.
"""

from __future__ import annotations

import io
import struct
import zlib
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

_ESCAPE = 0xFFFFFFFF  # a 32-bit field has this value if the number is in a 64-bit field
_WIDE_FROM = _ESCAPE  # the least number that needs a 64-bit field
_HEAD_ROOM = 1024  # more bytes than a .npy head has
_ALIGNMENT = 64
_DATE_1980 = (0, 0x21)  # 1 January 1980, 0 h: a fixed date, so that equal setpoints make equal files
_VERSION_64 = 45
_VERSION = 20


@dataclass
class _Member:
    name: bytes
    dtype: np.dtype[Any]
    size: int
    offset: int
    data: int
    is_large: bool
    written: int = 0
    checksum: int = 0


class NpyArchive:
    """An archive of arrays of these shapes and types; `append` fills them."""

    def __init__(self, file: BinaryIO, arrays: dict[str, tuple[tuple[int, ...], np.dtype[Any]]]) -> None:
        self._file = file
        self._members: dict[str, _Member] = {}
        offset = 0
        for name, (shape, dtype) in arrays.items():
            member_name = f"{name}.npy".encode()
            body = int(np.prod(shape, dtype=np.int64)) * dtype.itemsize
            is_large = body + _HEAD_ROOM >= _WIDE_FROM
            data = offset + 30 + len(member_name) + (20 if is_large else 0)
            head = _npy_head(shape, dtype, data)
            member = _Member(member_name, dtype, len(head) + body, offset, data, is_large)
            self._members[name] = member
            self._write(member, head)
            offset = member.data + member.size
        self._end = offset

    def append(self, name: str, rows: NDArray[Any]) -> None:
        """Appends rows to the array of that name, or sets its number if it is a scalar."""
        member = self._members[name]
        rows = np.ascontiguousarray(rows, dtype=member.dtype)
        if rows.size:
            self._write(member, rows.data.cast("B"))

    def close(self) -> None:
        """Writes the heads again with the checksums, then the directory."""
        for name, member in self._members.items():
            if member.written != member.size:
                missing = member.size - member.written
                raise ValueError(f"{name} lacks {missing} of {member.size} bytes")
            self._file.seek(member.offset)
            self._file.write(_local_head(member))
        self._file.seek(self._end)
        directory = b"".join(_directory_entry(member) for member in self._members.values())
        self._file.write(directory + _directory_end(len(self._members), len(directory), self._end))

    def _write(self, member: _Member, data: bytes | memoryview) -> None:
        if member.written + len(data) > member.size:
            raise ValueError(f"{member.name.decode()} has more rows than announced")
        self._file.seek(member.data + member.written)
        self._file.write(data)
        member.written += len(data)
        member.checksum = zlib.crc32(data, member.checksum)


def _npy_head(shape: tuple[int, ...], dtype: np.dtype[Any], offset: int) -> bytes:
    """The head of a .npy file at this offset of the archive, padded so that its rows can be mapped."""
    buffer = io.BytesIO()
    header = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(buffer, header)
    head = buffer.getvalue()
    text = head[10:-1] + b" " * (-(offset + len(head)) % _ALIGNMENT) + b"\n"
    return head[:8] + struct.pack("<H", len(text)) + text


def _common(member: _Member) -> bytes:
    """The fields that the local head and the directory entry share: from the version to the size."""
    version = _VERSION_64 if member.is_large else _VERSION
    size = _ESCAPE if member.is_large else member.size
    return struct.pack("<HHHHHIII", version, 0, 0, *_DATE_1980, member.checksum, size, size)


def _local_head(member: _Member) -> bytes:
    extra = struct.pack("<HHQQ", 1, 16, member.size, member.size) if member.is_large else b""
    lengths = struct.pack("<HH", len(member.name), len(extra))
    return b"PK\3\4" + _common(member) + lengths + member.name + extra


def _directory_entry(member: _Member) -> bytes:
    wide = [member.size, member.size] if member.is_large else []
    is_far = member.offset >= _WIDE_FROM
    wide += [member.offset] if is_far else []
    extra = struct.pack(f"<HH{len(wide)}Q", 1, 8 * len(wide), *wide) if wide else b""
    version = struct.pack("<H", _VERSION_64 if wide else _VERSION)
    lengths = struct.pack("<HHHHH", len(member.name), len(extra), 0, 0, 0)
    offset = struct.pack("<II", 0, _ESCAPE if is_far else member.offset)
    return b"PK\1\2" + version + _common(member) + lengths + offset + member.name + extra


def _directory_end(count: int, size: int, offset: int) -> bytes:
    is_far = offset >= _WIDE_FROM
    end = struct.pack("<HHHHIIH", 0, 0, count, count, size, _ESCAPE if is_far else offset, 0)
    if not is_far:
        return b"PK\5\6" + end
    record = struct.pack("<QHHIIQQQQ", 44, _VERSION_64, _VERSION_64, 0, 0, count, count, size, offset)
    locator = struct.pack("<IQI", 0, offset + size, 1)
    return b"PK\6\6" + record + b"PK\6\7" + locator + b"PK\5\6" + end
