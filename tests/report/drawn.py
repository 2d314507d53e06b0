"""The data in a page, read as `feedplan/report/container.py` describes it."""

from __future__ import annotations

import base64
import json
import re
import zlib
from typing import Any

import numpy as np


def unpacked(content: bytes) -> dict[str, Any]:
    """The data in bytes that `contained` has made."""
    end = 4 + int.from_bytes(content[:4], "little")
    kinds = {"f4": "<f4", "i4": "<i4", "u1": "<u1"}

    def read(entry: dict[str, Any]) -> Any:
        if "array" not in entry:
            return entry
        kind, count = np.dtype(kinds[entry["array"]]), entry["count"]
        planes = np.frombuffer(content, np.uint8, kind.itemsize * count, end + entry["at"])
        return planes.reshape(kind.itemsize, count).T.copy().view(kind).reshape(count)

    data = json.loads(content[4:end], object_hook=read)
    assert isinstance(data, dict)
    return data


def data_of(text: str) -> dict[str, Any]:
    found = re.search(r'<script type="text/plain" id="data">(.*?)</script>', text, flags=re.S)
    assert found
    return unpacked(zlib.decompress(base64.b64decode(found.group(1))))
