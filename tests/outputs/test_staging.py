"""A folder of outputs appears complete or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from feedplan.errors import InputError
from feedplan.outputs._staging import staged


def fail_in(folder: Path) -> None:
    with staged(folder, last="z") as stage:
        (stage / "z").write_text("new")
        raise KeyError


def write_new(folder: Path, names: str) -> None:
    """Writes files of these names, in this order."""
    with staged(folder, last=names[-1]) as stage:
        for name in names:
            (stage / name).write_text("new")


def test_a_new_folder_appears_at_the_end_with_its_parents(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    with staged(folder, last="z") as stage:
        (stage / "z").write_text("1")
        assert not (tmp_path / "a").exists()
    assert (folder / "z").read_text() == "1"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a"]


def test_an_error_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(KeyError):
        fail_in(tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


def test_an_error_leaves_the_earlier_files_alone(tmp_path: Path) -> None:
    (tmp_path / "z").write_text("old")
    with pytest.raises(KeyError):
        fail_in(tmp_path)
    assert [(entry.name, entry.read_text()) for entry in tmp_path.iterdir()] == [("z", "old")]


def test_an_existing_folder_keeps_its_other_files_and_gets_the_last_file_last(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine").write_text("keep")
    (tmp_path / "b").write_text("old")
    moved = []

    def record(move: str) -> None:
        own = getattr(Path, move)

        def recorded(source: Path, target: Path) -> None:
            moved.append(target.name)
            own(source, target)
            assert target.name == "b" or not (tmp_path / "b").exists(), "the old one goes first"

        monkeypatch.setattr(Path, move, recorded)

    record("rename")
    record("replace")
    write_new(tmp_path, "cab")
    assert moved == ["a", "c", "b"]
    assert {entry.name: entry.read_text() for entry in tmp_path.iterdir()} == {
        "mine": "keep",
        "a": "new",
        "b": "new",
        "c": "new",
    }


def test_a_folder_in_the_way_of_a_file_leaves_the_earlier_files_alone(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "z").write_text("old")
    with pytest.raises(InputError, match=r"cannot be written \(a is a folder\): choose another"):
        write_new(tmp_path, "az")
    assert (tmp_path / "z").read_text() == "old"
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["a", "z"]


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for folder in (tmp_path / "file", tmp_path / "file" / "deeper"):
        with (
            pytest.raises(InputError, match="file is a file, not a folder: choose another"),
            staged(folder, last="z"),
        ):
            pass


@pytest.mark.parametrize(
    ("number", "words"),
    [
        (errno.ENOSPC, "no space left.*free some space"),
        (errno.EACCES, "permission denied.*choose"),
    ],
)
def test_a_refusal_of_the_file_system_is_one_sentence(number: int, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words), staged(tmp_path / "a", last="z"):
        raise OSError(number, os.strerror(number))
    assert list(tmp_path.iterdir()) == []
