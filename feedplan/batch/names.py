"""Makes names of folders from the names of programs: readable, valid on every file system, all different."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable
from pathlib import PurePath

# The greatest length of a name: file systems allow 255 bytes, and the length of paths is limited too.
LONGEST = 100
_OTHERS = re.compile(r"[^A-Za-z0-9._+-]+")
# Names that Windows reserves for devices.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\.|$)", re.IGNORECASE)


def safe_name(program: str, parts: Iterable[str] = ()) -> str:
    """A name of letters, digits and `._+-` from the name of a program and the swept options."""
    stem = PurePath(program.replace("\\", "/")).stem
    plain = unicodedata.normalize("NFKD", stem).encode("ascii", "ignore").decode()
    words = [_OTHERS.sub("_", word).strip("._-") for word in (plain, *parts)]
    words[0] = words[0] or "program"
    if _DEVICES.match(words[0]):
        words[0] = f"program-{words[0]}"
    tail = "".join(f"-{word}" for word in words[1:] if word)
    return words[0][: max(LONGEST - len(tail), 10)].rstrip("._-") + tail[: LONGEST - 10]


class Names:
    """Gives each folder a different name; upper and lower case count as equal."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = {name.lower() for name in taken}
        self._asked: Counter[str] = Counter()

    def own(self, name: str) -> str:
        """The name, with a number after it if it was used before."""
        found = name
        while found.lower() in self._taken:
            self._asked[name.lower()] += 1
            found = f"{name}-{self._asked[name.lower()] + 1}"
        self._taken.add(found.lower())
        return found
