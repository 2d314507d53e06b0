"""Setpoints read from a file, checked to be what the names promise."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from feedplan.errors import InputError
from feedplan.outputs import QUANTITIES
from feedplan.setpoints import SetpointChunk


def chunk_of(arrays: Mapping[str, Any], file: FilePath) -> SetpointChunk:
    """The chunk in these named arrays. Raises InputError naming the file and what is wrong with it."""
    missing = [name for name in ("t", *QUANTITIES, "line", "axes") if name not in arrays]
    if missing:
        raise InputError(f"{file} is not a file of setpoints: {', '.join(missing)} is missing")
    axes = tuple(str(name) for name in np.asarray(arrays["axes"]).ravel())
    t = np.asanyarray(arrays["t"])
    if t.ndim != 1 or len(t) == 0:
        raise InputError(f"{file} holds no setpoints: t has the shape {t.shape}, (n,) is needed")
    shapes = {"t": (len(t),), "line": (len(t),)} | {name: (len(t), len(axes)) for name in QUANTITIES}
    for name, shape in shapes.items():
        array = np.asanyarray(arrays[name])
        if array.shape != shape or array.dtype.kind not in "fiu":
            raise InputError(f"{file}: {name} has the shape {array.shape}: give numbers of shape {shape}")
    t, position, velocity, acceleration, jerk = (
        np.asanyarray(arrays[name], dtype=np.float64) for name in ("t", *QUANTITIES)
    )
    with np.errstate(invalid="ignore"):
        line = np.asanyarray(arrays["line"]).astype(np.int32, copy=False)
    return SetpointChunk(t, position, velocity, acceleration, jerk, line, axes)
