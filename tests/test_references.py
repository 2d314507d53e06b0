"""Files and names of the Python package that comments and documents mention exist."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
SOLVERS = ROOT / "solvers"
KERNELS = SOLVERS / "README.md"
SOURCES = [KERNELS, *SOLVERS.glob("*/src/**/*.rs"), *(ROOT / "feedplan").rglob("*.py")]


def exists(name: str) -> bool:
    """Whether this dotted name is a module, a name in a module, or a field or member of that name."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:count]))
        except ModuleNotFoundError:
            continue
        for part in parts[count:]:
            if part in getattr(found, "__dataclass_fields__", ()):
                return True
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


def missing_names(text: str) -> Iterator[str]:
    yield from (name for name in re.findall(r"`(feedplan(?:\.\w+)+)", text) if not exists(name))


def test_names_of_the_package_exist() -> None:
    found = {(file.name, name) for file in SOURCES for name in missing_names(file.read_text())}
    assert not found
    assert list(missing_names("`feedplan.profile.PhaseLaw.FEED`, `feedplan.profile.Law`")) == [
        "feedplan.profile.Law"
    ]


def test_files_that_the_table_of_kernels_names_exist() -> None:
    named = re.findall(r"`((?:\w+/)+\w+\.(?:rs|py))`", KERNELS.read_text())
    assert len(named) > 50
    assert [name for name in named if not any((folder / name).exists() for folder in (ROOT, SOLVERS))] == []
