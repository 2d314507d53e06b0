"""The verdict of an audit: the worst place of every limit, as numbers and as sentences."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from feedplan.audit.worst import Findings
from feedplan.units import finite

# A measured value passes up to this multiple of its limit. The margin of 1e-6 covers the planner's own
# rounding over long paths (about 1e-10) and is negligible for a machine.
PASS_MARK = 1.0 + 1e-6


# Times [s] from this one on are shown by significant digits, not by decimals.
_LONGEST = 1e12


class _Kind(NamedTuple):
    """The name of a checked quantity in a sentence, and its unit."""

    quantity: str
    unit: str


_KINDS = {
    "feed": _Kind("speed", "mm/s"),
    "velocity": _Kind("velocity", "mm/s"),
    "acceleration": _Kind("acceleration", "mm/s²"),
    "jerk": _Kind("jerk", "mm/s³"),
    "chord": _Kind("chord error", "mm"),
    "deviation": _Kind("distance between followed and programmed path", "mm"),
    "travel": _Kind("position", "mm"),
    "jump": _Kind("jump of velocity", "mm/s"),
    "acceleration_jump": _Kind("jump of acceleration where the curvature jumps", "mm/s²"),
    "continuity": _Kind("jump of speed where pieces meet", "mm/s"),
    "acceleration_continuity": _Kind("jump of the acceleration along the path", "mm/s²"),
    "junction": _Kind("speed beyond what is allowed where pieces meet or runs end,", "mm/s"),
    "duration": _Kind("relative error of a recorded duration", ""),
    "order": _Kind("gap between the phases of the profile", "mm"),
    "gap": _Kind("gap in the path", "mm"),
    "place": _Kind("distance of a setpoint from its place on the path", "mm"),
    "grid": _Kind("irregularity of the time steps", "s"),
    "recorded_velocity": _Kind("error of the recorded velocity", "mm/s"),
    "recorded_acceleration": _Kind("error of the recorded acceleration", "mm/s²"),
    "recorded_change": _Kind("change of the recorded velocity beyond the recorded acceleration", "mm/s²"),
    "recorded_jerk": _Kind("change of the recorded acceleration beyond the recorded jerk", "mm/s³"),
    "cubic_acceleration": _Kind("acceleration of cubics from knot to knot", "mm/s²"),
    "numbers": _Kind("number that is not finite or out of its range", ""),
}

# Checks that are reported, never judged: they measure something that is not part of a plan.
_TOLD = ("cubic_acceleration",)

# The values that None replaces in JSON.
_NOT_FINITE = {"worst": math.nan, "limit": math.inf, "ratio": math.nan, "time": math.nan}

# Limits of the machine and the program; all other checks are checks of consistency.
_LIMITS = {
    *("feed", "velocity", "acceleration", "jerk", "chord", "deviation", "travel"),
    *("jump", "acceleration_jump"),
}

# Limits of velocity jumps up to this value count as no jump allowed [mm/s].
_NO_JUMP = 1e-3

# If these checks fail, the results of the others are meaningless, so they are named first.
_EXPLAINING = ("numbers", "grid")


@dataclass(frozen=True)
class LimitCheck:
    """The worst place of one limit.

    `worst` is the value measured there, less its rounding error bound, `limit` the allowed value, `ratio`
    worst / limit; `time` [s] and source `line` are the place (line 0: not known). `axis` is None where the
    check belongs to no axis. A check that is not `judged` is only reported. For `travel`, `ratio` is the
    distance from the middle of the travel over half the travel. `length` is the unit of positions or of the
    path, `unit` that of the values.
    """

    name: str
    axis: str | None
    worst: float
    limit: float
    ratio: float
    time: float
    line: int
    judged: bool
    length: str = "mm"

    @property
    def ok(self) -> bool:
        """Whether the limit holds or is not judged. NaN never holds."""
        return not self.judged or self.ratio <= PASS_MARK

    @property
    def is_limit(self) -> bool:
        """Whether it is a limit of the machine or the program, not a check of consistency."""
        # If no velocity jump is allowed at corners, this check only confirms that there is none.
        return self.name in _LIMITS and (self.name != "jump" or self.limit > _NO_JUMP)

    @property
    def unit(self) -> str:
        """Unit of `worst` and `limit`."""
        return _KINDS[self.name].unit.replace("mm", self.length)

    def sentence(self) -> str:
        """Place, value and limit in words."""
        time = f"{self.time:.6f} s" if abs(self.time) < _LONGEST else f"{self.time:.9g} s"
        place = f"line {self.line}, {time}" if self.line else time
        kind = _KINDS[self.name]
        what = f"{self.axis} {kind.quantity}" if self.axis else kind.quantity
        if self.name == "numbers":
            return f"{place}: {what}"
        unit = f" {self.unit}" if self.unit else ""
        times = f" ({self.ratio:.7g} times)" if math.isfinite(self.ratio) else ""
        return f"{place}: {what} {self.worst:.7g}{unit}, the limit is {self.limit:.7g}{unit}{times}"

    def to_json(self) -> dict[str, Any]:
        """The numbers by name; None for numbers that are not finite."""
        return {
            "ok": self.ok,
            "worst": finite(self.worst),
            "limit": finite(self.limit),
            "ratio": finite(self.ratio),
            "time": finite(self.time),
            "line": self.line,
            "judged": self.judged,
        }


@dataclass(frozen=True)
class Audit:
    """The verdict: the worst place of every limit, from `checked_samples` samples."""

    checks: tuple[LimitCheck, ...]
    checked_samples: int

    @property
    def broken(self) -> tuple[LimitCheck, ...]:
        """The checks that fail."""
        return tuple(check for check in self.checks if not check.ok)

    @property
    def failures(self) -> tuple[str, ...]:
        """A sentence for each failed check (place, value, limit); checks that explain others come first."""
        if not self.checks:
            return ("there is nothing that could be measured",)
        broken = sorted(self.broken, key=lambda check: check.name not in _EXPLAINING)
        return tuple(check.sentence() for check in broken)

    @property
    def ok(self) -> bool:
        """Whether everything was measured and every limit holds."""
        return bool(self.checks) and not self.broken

    @property
    def nearest(self) -> LimitCheck | None:
        """The judged limit of the machine or the program with the greatest ratio."""
        used = (check for check in self.checks if check.judged and check.is_limit)
        return max(used, key=lambda check: check.ratio, default=None)

    def __repr__(self) -> str:
        failures = self.failures
        said = "every limit holds" if self.ok else f"failed, {len(failures)} in all: {failures[0]}"
        return f"<Audit of {self.checked_samples} samples: {said}>"

    def check(self, name: str, axis: str | None = None) -> LimitCheck:
        """The check of a name and axis. Raises KeyError if it was not made."""
        for check in self.checks:
            if (check.name, check.axis) == (name, axis):
                return check
        raise KeyError((name, axis))

    def to_json(self) -> dict[str, Any]:
        """`ok`, `checked_samples`, `failures`, and the checks by name, or by name and axis."""
        result: dict[str, Any] = {
            "ok": self.ok,
            "checked_samples": self.checked_samples,
            "failures": list(self.failures),
        }
        for check in self.checks:
            if check.axis is None:
                result[check.name] = check.to_json()
            else:
                result.setdefault(check.name, {})[check.axis] = check.to_json()
        return result

    @classmethod
    def from_json(cls, table: Mapping[str, Any], units: Mapping[str, str], length: str) -> Audit:
        """Rebuilds the audit from `to_json`; `units` are the axes' units, `length` is the unit of the
        path."""
        checks = []
        for name, entry in table.items():
            if name not in _KINDS:
                continue
            by_axis = {None: entry} if "ratio" in entry else entry
            for axis, row in by_axis.items():
                numbers = {key: other if row[key] is None else row[key] for key, other in _NOT_FINITE.items()}
                unit = length if axis is None else units[axis]
                checks.append(
                    LimitCheck(name, axis, **numbers, line=row["line"], judged=row["judged"], length=unit)
                )
        return cls(tuple(checks), table["checked_samples"])


def join(
    results: Iterable[Findings],
    axes: tuple[str, ...],
    jerk: bool,
    units: tuple[str, ...],
    way_unit: str,
) -> Audit:
    """The verdict from several findings: the worst of each check, in the order of `_KINDS`.

    `units` are the axes' units, `way_unit` is the unit of lengths that belong to no axis.
    """
    checks, samples = [], 0
    for findings, count in results:
        samples += count
        checks += [
            LimitCheck(
                name=name,
                axis=axes[axis] if axis >= 0 else None,
                worst=value,
                limit=limit,
                ratio=ratio,
                time=time,
                line=line,
                judged=(jerk or name != "jerk") and name not in _TOLD,
                length=units[axis] if axis >= 0 else way_unit,
            )
            for name, axis, value, limit, ratio, time, line in findings
        ]
    return Audit(_worst(checks, axes), samples)


def worst_of(audits: Sequence[Audit], axes: tuple[str, ...]) -> Audit:
    """One verdict from those of several parts: the worst of each check."""
    checks = (check for audit in audits for check in audit.checks)
    return Audit(_worst(checks, axes), sum(audit.checked_samples for audit in audits))


def _worst(checks: Iterable[LimitCheck], axes: tuple[str, ...]) -> tuple[LimitCheck, ...]:
    """The worst of each name and axis, in the order of `_KINDS`, then of the axes."""
    worst: dict[tuple[str, str | None], LimitCheck] = {}
    for check in checks:
        known = worst.get((check.name, check.axis))
        if known is None or not check.ratio <= known.ratio:
            worst[check.name, check.axis] = check
    order, of_axis = list(_KINDS), (None, *axes)
    keys = sorted(worst, key=lambda key: (order.index(key[0]), of_axis.index(key[1])))
    return tuple(worst[key] for key in keys)
