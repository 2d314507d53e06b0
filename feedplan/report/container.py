"""What a page draws as bytes: its table in JSON, then all arrays of the table as they are in memory.

    4 bytes    length of the JSON, little-endian
    the JSON   with {"array": "f4", "at": 0, "count": 3} in the place of each array; spaces up to a multiple
               of 4 bytes
    arrays     little-endian, each at a multiple of 4 bytes from the end of the JSON

The page reads it by `page/source/data.js`.
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
    """The data with its arrays: floats and integers become numbers of 32 bits, unsigned ones of 8."""
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
    """Bytes compressed and in letters, as a page holds them."""
    return base64.b64encode(zlib.compress(content, 6)).decode("ascii")


def _in_memory(array: NDArray[Any]) -> bytes:
    with np.errstate(over="ignore"):
        return array.astype(_KINDS[array.dtype.kind]).tobytes()


def _padded(content: bytes, letter: bytes) -> bytes:
    return content + letter * (-len(content) % 4)
