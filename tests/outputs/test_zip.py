"""Zip archives whose members are written in one pass, also with the 64-bit fields for large files."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest

from feedplan.outputs import _zip


def archive(count: int) -> io.BytesIO:
    file = io.BytesIO()
    shapes = {
        "a": ((count, 2), np.dtype("<f8")),
        "b": ((count,), np.dtype("<i4")),
        "c": ((0,), np.dtype("<f8")),
    }
    members = _zip.NpyArchive(file, shapes)
    for first in range(0, count, 7):
        rows = np.arange(first, min(first + 7, count))
        members.append("b", rows)
        members.append("a", np.stack([rows, -rows], axis=1))
    members.close()
    return file


@pytest.mark.parametrize("limit", [zipfile.ZIP64_LIMIT, 1, 300])
def test_members_written_in_turns_are_read_whole(limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(zipfile, "ZIP64_LIMIT", limit)
    file = archive(100)
    with zipfile.ZipFile(file) as check:
        assert check.testzip() is None
        assert any(info.extract_version == 45 for info in check.infolist()) == (limit < 1000)
    file.seek(0)
    with np.load(file) as arrays:
        np.testing.assert_array_equal(arrays["b"], np.arange(100))
        np.testing.assert_array_equal(arrays["a"], np.stack([np.arange(100.0), -np.arange(100.0)], axis=1))
        assert arrays["c"].shape == (0,)


def test_the_same_rows_make_the_same_bytes() -> None:
    assert archive(50).getvalue() == archive(50).getvalue()


def test_more_rows_than_announced_are_refused() -> None:
    members = _zip.NpyArchive(io.BytesIO(), {"a": ((2,), np.dtype("<f8"))})
    with pytest.raises(ValueError, match="more rows than announced"):
        members.append("a", np.zeros(3))
