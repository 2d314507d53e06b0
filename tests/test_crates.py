"""The files of a native crate depend on each other without cycles: each can be read after those it uses."""

from __future__ import annotations

import re
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

SOLVERS = Path(__file__).parent.parent / "solvers"
CRATES = sorted(source.parent.name for source in SOLVERS.glob("*/src"))

Module = tuple[str, ...]


def module_of(file: Path, source: Path) -> Module:
    parts = file.relative_to(source).with_suffix("").parts
    return () if parts in {("lib",), ("main",)} else parts


def code_of(file: Path) -> str:
    """The text without comments and tests."""
    return re.sub(r"//.*", "", file.read_text()).partition("#[cfg(test)]\nmod tests")[0]


def used_paths(code: str, children: set[str]) -> Iterator[list[str]]:
    """Paths into the crate: from `use` lines, with braces expanded, and from names in the code."""
    first = "|".join(["crate", "self", "super", *sorted(children)])
    for line in re.findall(rf"\buse ((?:{first})\b[^;]*);", code):
        while "{" in line:
            line = re.sub(
                r"([\w:]*)\{([^{}]*)\}", lambda m: ",".join(m[1] + n.strip() for n in m[2].split(",")), line
            )
        yield from (path.split("::") for path in line.split(","))
    yield from (path.split("::") for path in re.findall(r"(?<![\w:$])(?:crate|super)(?:::\w+)+", code))


def uses(crate: str) -> dict[Module, set[Module]]:
    source = SOLVERS / crate / "src"
    files = {module_of(file, source): file for file in source.rglob("*.rs")}
    found: dict[Module, set[Module]] = {}
    for module, file in files.items():
        children = {other[-1] for other in files if other and other[:-1] == module}
        found[module] = set()
        for path in used_paths(code_of(file), children):
            place = () if path[0] == "crate" else module
            for name in path:
                if name == "super":
                    place = place[:-1]
                elif (*place, name) in files:
                    place = (*place, name)
                elif name not in {"crate", "self"}:
                    break
            found[module] |= {place} - {module}
    return found


@pytest.mark.parametrize("crate", CRATES)
def test_no_file_uses_one_that_is_built_on_it(crate: str) -> None:
    TopologicalSorter(uses(crate)).prepare()
