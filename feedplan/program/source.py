"""The content of a part program, from a file, or from the text itself as str, bytes or a stream."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, NamedTuple

from feedplan.arguments import file_path, printable, shown
from feedplan.errors import InputError, ProgramError, unreadable

Source = str | bytes | os.PathLike[str] | IO[str] | IO[bytes]

MAX_BYTES = 1 << 30
# The number of bytes of a stream that are read at once.
_PART = 1 << 24
# The name of a program without a file in messages.
NO_NAME = "program"
_REMEDY = "the path of a file, the program as text with its line breaks or as bytes, or an open file"


class Content(NamedTuple):
    """The `content` of a program, its `name` in messages, and its `text`: the path of its file, else the
    content itself."""

    content: bytes
    name: str
    text: Path | bytes


def require_other(own: object, *places: Path, what: str = "program") -> None:
    """Raises InputError if one of the `places` is the file `own`, which was read and would be overwritten."""
    for place in places:
        with suppress(OSError, ValueError):  # no such file, or an impossible file name
            if isinstance(own, (str, os.PathLike)) and place.samefile(own):
                raise InputError(f"{place} is the {what} itself, which would be lost: choose another file")


def content_of(source: Source, name: str | None = None, max_bytes: int = MAX_BYTES) -> Content:
    """The content of a program; `name` replaces the file's name in messages.

    A str with a line break is the program itself, any other one the path of its file. Raises ProgramError in
    one sentence where it cannot be read, is empty or larger than `max_bytes`.
    """
    if isinstance(source, str) and ("\n" in source or "\r" in source):
        source = source.encode("utf-8", "surrogateescape")
    if isinstance(source, (bytes, bytearray, memoryview)):
        content, name = bytes(source), name or NO_NAME
        _check_size(len(content), name, max_bytes)
        return Content(content, name, content)
    if callable(getattr(source, "read", None)):
        return _of_stream(source, name, max_bytes)
    try:
        file = file_path(source, "the program", _REMEDY)
    except InputError as error:
        raise ProgramError(str(error)) from None
    return Content(_of_file(file, max_bytes), name or printable(file.name), file.absolute())


def _of_file(path: Path, max_bytes: int) -> bytes:
    try:
        if path.is_dir():
            raise ProgramError(f"{path} is a directory: give the program file in it")
        size = path.stat().st_size
        _check_size(size, str(path), max_bytes)
        with path.open("rb") as stream:
            # Pipes and other special files have size 0, whatever they contain.
            content = stream.read(size + 1) if size else b"".join(_parts(stream, max_bytes))
    except OSError as error:
        raise ProgramError(unreadable(path, error, "the path of a part program")) from None
    return _checked(content, str(path), max_bytes)


def _of_stream(stream: Any, name: str | None, max_bytes: int) -> Content:
    own = getattr(stream, "name", None)
    name = name or (Path(own).name if isinstance(own, str) else "") or NO_NAME
    try:
        parts = list(_parts(stream, max_bytes))
    except (OSError, ValueError) as error:  # closed, open only for writing, or no text
        raise ProgramError(unreadable(name, error, "an open stream of text or bytes")) from None
    texts = [part.encode("utf-8", "surrogateescape") if isinstance(part, str) else part for part in parts]
    odd = next((part for part in texts if not isinstance(part, bytes)), None)
    if odd is not None:
        raise ProgramError(f"{name} gives {shown(odd)}: give a stream of text or bytes")
    content = _checked(b"".join(texts), name, max_bytes)
    return Content(content, name, content)


def _parts(stream: Any, max_bytes: int) -> Iterator[Any]:
    """The parts of a stream, up to the one that exceeds `max_bytes`."""
    size = 0
    while size <= max_bytes and (part := stream.read(min(_PART, max_bytes + 1 - size))):
        yield part
        size += len(part) if isinstance(part, (bytes, str)) else max_bytes + 1


def _checked(content: bytes, place: str, max_bytes: int) -> bytes:
    """The content; raises ProgramError where it is empty or exceeds `max_bytes`."""
    if not content:
        raise ProgramError(f"{place} is empty: give a part program")
    _check_size(len(content), place, max_bytes)
    return content


def _check_size(size: int, place: str, max_bytes: int) -> None:
    if size > max_bytes:
        raise ProgramError(
            f"{place} has {size} bytes, more than the {max_bytes} that are read: split it, or raise max_bytes"
        )
