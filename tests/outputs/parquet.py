"""All formats; Parquet is skipped if its package is missing."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from feedplan.outputs import formats

needs_pyarrow = pytest.mark.skipif(
    find_spec("pyarrow") is None, reason="the package pyarrow is missing: pip install feedplan[parquet]"
)
FORMATS = [pytest.param(name, marks=needs_pyarrow if name == "parquet" else ()) for name in formats()]
