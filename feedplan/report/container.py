"""Writes the data of a page as bytes: a JSON object, then its arrays.

    4 bytes    length of the JSON, little-endian
    the JSON   with {"array": "f4", "at": 0, "count": 3} instead of each array; spaces up to a multiple
               of 4 bytes
    arrays     each at a multiple of 4 bytes from the end of the JSON: the first byte of each number,
               little-endian, then the second byte of each, and so on

`page/source/data.js` reads it. The high bytes of neighbouring numbers are similar, so a compressed page is a
quarter smaller than with the bytes of each number together.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

_KINDS = {"f": "<f4", "i": "<i4", "u": "<u1"}


def contained(data: Mapping[str, Any]) -> bytes:
    """The data as bytes in this form: floats and integers have 32 bits, unsigned integers 8 bits."""
    arrays: list[bytes] = []
    size = 0

    def plain(value: Any) -> Any:
        nonlocal size
        if isinstance(value, Mapping):
            return {name: plain(entry) for name, entry in value.items()}
        if isinstance(value, (list, tuple)):
            return [plain(entry) for entry in value]
        if not isinstance(value, np.ndarray):
            return value
        content = _padded(_in_memory(value), b"\0")
        entry = {"array": _KINDS[value.dtype.kind][1:], "at": size, "count": len(value)}
        arrays.append(content)
        size += len(content)
        return entry

    text = json.dumps(plain(data), allow_nan=False, separators=(",", ":")).encode()
    text = _padded(text, b" ")
    return b"".join((len(text).to_bytes(4, "little"), text, *arrays))


def as_text(content: bytes) -> str:
    """Bytes, compressed and in base 64, for the text of a page."""
    # The low bytes of floats are hardly compressible: level 6 would take twice the time for 1 % less.
    return base64.b64encode(zlib.compress(content, 1)).decode("ascii")


def _in_memory(array: NDArray[Any]) -> bytes:
    with np.errstate(over="ignore"):
        plain = np.ascontiguousarray(array, _KINDS[array.dtype.kind])
    return plain.view(np.uint8).reshape(len(plain), plain.itemsize).T.tobytes()


def _padded(content: bytes, letter: bytes) -> bytes:
    return content + letter * (-len(content) % 4)
