"""Reads text files that include each other, with limits on their size, number and depth."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

from feedplan.arguments import shown
from feedplan.errors import MachineError, unreadable

# Limits for all files together: size [bytes], number, and depth of inclusion.
MAX_BYTES = 1 << 20
MAX_FILES = 100
MAX_DEPTH = 16
# Longer lines are ignored: they hold no setting.
LONGEST_LINE = 4096

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?=[\s#;]|\Z)", re.ASCII)


@dataclass(frozen=True)
class Setting:
    """A setting's text in a file: `label` is its name for messages, `place` its file and line."""

    label: str
    text: str
    place: str

    @property
    def number(self) -> float:
        """The number at the start of the text; raises MachineError where there is none."""
        match = _NUMBER.match(self.text)
        if match is None:
            raise MachineError(f"{self.place}: {self.label} is {shown(self.text)}: give a number")
        return float(match[0])

    @property
    def source(self) -> str:
        """`[AXIS_X] MAX_VELOCITY = 5, mill.ini line 12`."""
        return f"{self.label} = {self.text}, {self.place}"


@dataclass
class TextFiles:
    """The imported file and the files that it includes; `missing` names included files that do not exist."""

    main: Path
    missing: list[str] = field(default_factory=list)
    _bytes: int = 0
    _files: int = 0

    def lines(self, path: Path) -> Iterator[tuple[str, str]]:
        """The lines of a file, without line ends, each with its place for messages.

        Raises MachineError where it cannot be read, is binary, or exceeds the limits above.
        """
        self._files += 1
        if self._files > MAX_FILES:
            raise MachineError(
                f"{self.main} includes more than {MAX_FILES} files: give the one with the limits"
            )
        try:
            if path.is_dir():
                raise MachineError(f"{path} is a directory: give the file in it")
            with path.open("rb") as stream:
                content = stream.read(MAX_BYTES + 1 - self._bytes)
        except (OSError, ValueError) as error:
            raise MachineError(unreadable(path, error, "the path of a controller's file")) from None
        self._bytes += len(content)
        if self._bytes > MAX_BYTES:
            raise MachineError(f"{path} has more than {MAX_BYTES} bytes: give the part with the limits")
        if b"\0" in content:
            raise MachineError(f"{path} is binary: give a text in UTF-8")
        text = content.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")
        for number, line in enumerate(text.split("\n"), 1):
            if len(line) <= LONGEST_LINE:
                yield line, f"{path.name} line {number}"

    def included(self, name: str, inside: tuple[Path, ...], place: str) -> list[Path]:
        """The files that the last of `inside` includes by `name`, in order; names may contain `*` and `?`.

        Raises MachineError where a file would include itself, or inclusion is too deep. A name without a file
        is added to `missing`.
        """
        if len(inside) >= MAX_DEPTH:
            raise MachineError(f"{place}: files include each other more than {MAX_DEPTH} deep: give fewer")
        path = Path(name)
        try:
            path = inside[-1].parent / path.expanduser()
            pattern = path.name
            if any(letter in pattern for letter in "*?["):
                entries = sorted(path.parent.iterdir()) if path.parent.is_dir() else []
                found = [entry for entry in entries if fnmatchcase(entry.name, pattern) and entry.is_file()]
            else:
                found = [path] if path.is_file() else []
                self.missing += [] if found else [name]
            known = [own.resolve() for own in inside]
            again = next((entry for entry in found if entry.resolve() in known), None)
        except (OSError, ValueError, RuntimeError) as error:  # not a path, or no such home directory
            raise MachineError(f"{place}: {shown(name)} cannot be included ({error}): correct it") from None
        if again is not None:
            raise MachineError(f"{place}: {again.name} includes itself: take this line out")
        return found
