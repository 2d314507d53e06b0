"""Reads the `[kinematics]` table of a machine file key by key; every error names machine, key and remedy."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from feedplan.arguments import is_number
from feedplan.machine.checks import require

Vector = tuple[float, float, float]


class Parameters:
    """The keys of a kinematics and their values; `finish` refuses keys that were never read."""

    def __init__(self, values: Mapping[str, Any], machine: str) -> None:
        self.machine = machine
        self._values = dict(values)
        self._asked: list[str] = []

    def number(self, key: str, default: float | None = None, unit: str = "mm") -> float:
        """A finite number; it is required if there is no default."""
        value = self._take(key, default)
        self.require(_finite(value), key, value, f"a finite number [{unit}]")
        return float(value)

    def point(self, key: str, default: Vector | None = None) -> Vector:
        """Three finite numbers [mm]."""
        value = self._take(key, default)
        good = isinstance(value, (list, tuple)) and len(value) == 3 and all(_finite(v) for v in value)
        self.require(good, key, value, "three finite numbers [x, y, z] [mm]")
        return float(value[0]), float(value[1]), float(value[2])

    def letters(self, key: str, allowed: tuple[str, ...]) -> tuple[str, ...]:
        """A list of axis letters out of those allowed; empty by default."""
        value = self._take(key, [])
        good = isinstance(value, (list, tuple)) and all(v in allowed for v in value)
        self.require(good, key, value, f"a list of the letters {', '.join(allowed)}")
        return tuple(value)

    def choice(self, key: str, default: str, allowed: tuple[str, ...]) -> str:
        """One of the words allowed."""
        value = self._take(key, default)
        self.require(value in allowed, key, value, f"one of {', '.join(allowed)}")
        return str(value)

    def table(self, key: str) -> dict[str, Any]:
        """A table of any values; empty by default."""
        value = self._take(key, {})
        self.require(isinstance(value, Mapping), key, value, "a table")
        return dict(value)

    def require(self, condition: bool, key: str, value: object, remedy: str) -> None:
        """Raises MachineError, in one sentence, unless the condition holds."""
        require(condition, f"machine {self.machine}: kinematics {key}", value, remedy)

    def finish(self) -> None:
        """Raises MachineError if there are keys that were never read."""
        unknown = sorted(set(self._values) - set(self._asked))
        known = ", ".join(sorted(self._asked)) or "no keys but type"
        self.require(not unknown, "keys", unknown, f"only {known}")

    def _take(self, key: str, default: Any) -> Any:
        self._asked.append(key)
        value = self._values.get(key, default)
        return "missing" if value is None else value


def _finite(value: Any) -> bool:
    return is_number(value) and math.isfinite(value)
