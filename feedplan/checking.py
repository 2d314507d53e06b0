"""Checks setpoints in files: that their columns are consistent, that they match plan.json, and the audit.

The folder of a plan suffices: plan.json contains the machine, and describes the setpoints of the plan. For
other setpoints a machine must be given.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from feedplan.arguments import callback, flag, is_number, not_negative, number, positive, shown
from feedplan.audit import Audit, audit_setpoints
from feedplan.audit.events import require_events
from feedplan.audit.knots import audit_knots
from feedplan.errors import InputError, unreadable
from feedplan.geometry.corners import Corners
from feedplan.machine.machine import Machine
from feedplan.outputs import KNOTS, SETPOINTS, SetpointFile, load_setpoints, require_format
from feedplan.plan_folder import PROGRAM_FILE, SUMMARY_FILE
from feedplan.planners import corners, limits_jerk, methods
from feedplan.progress import Progress, of_stage, tell

# Greatest relative rounding error of the last time of setpoints.
ROUNDING = 1e-9


def check(
    place: str | os.PathLike[str],
    machine: Machine | str | os.PathLike[str] | None = None,
    *,
    resolution: float = 0.0,
    jerk: bool = False,
    progress: Progress | None = None,
) -> Audit:
    """Audits setpoints from files: `place` is a file of setpoints or the folder of a plan.

    If plan.json is in the folder of the setpoints, they must be those of that plan. `machine` (a Machine, or
    its name or file) replaces the machine of the plan. `resolution` [mm] is the last digit of rounded
    positions. Jerk is judged if the plan's method limits it or `jerk` is true. Events of the program must be
    in order and within the time of the setpoints, and the tool must be at rest at events that stop it.
    `progress(stage, done)` is called with `read`, then `audit`, and the finished share of the stage; an
    exception from it ends the check. Raises InputError for files that cannot be read, contradict each other
    or were changed.
    """
    resolution = number(resolution, "the resolution", "0 or more", not_negative, "mm")
    jerk = flag(jerk, "jerk")
    callback(progress)
    reading, auditing = of_stage(progress, "read"), of_stage(progress, "audit")
    tell(reading, 0.0)
    points = load_setpoints(place, reading)
    file = points.file.parent / SUMMARY_FILE
    plan = _read(file) if file.exists() else None
    if plan is not None:
        _require_same(plan, points)
    if machine is None:
        if plan is None:
            raise InputError(
                f"without {file} {points.file.name} names no machine: give the machine with --machine"
            )
        known = plan.machine
    else:
        known = Machine.of(machine)
    _require_units(points, known)
    tell(reading, 1.0)
    period = plan.rows[SETPOINTS][2] if plan else points.period or known.period
    how: dict[str, Any] = {
        "resolution": resolution,
        "jerk": jerk or (plan is not None and limits_jerk(plan.method)),
        "corners": plan is not None and corners(plan.method) is Corners.PROGRAMMED,
        "progress": auditing,
    }
    if points.rows == KNOTS:
        audit = audit_knots(points, known, **how)
    else:
        audit = audit_setpoints(points, known, period=period, **how)
    if audit.ok:  # events are only checked against good setpoints
        require_events(points.file, points.events, points, resolution, ROUNDING * period)
    return audit


@dataclass(frozen=True)
class _Plan:
    """The data of plan.json about its setpoints and knots. For each kind of rows in the plan: `rows` are
    their number, last time [s], and period or longest step [s]; `events` are the hashes of the events."""

    file: FilePath
    machine: Machine
    method: str
    axes: tuple[str, ...]
    rows: dict[str, tuple[int, float, float]]
    events: dict[str, str]


def _read(file: FilePath) -> _Plan:
    """Reads a plan.json. Raises InputError if it is damaged, changed or has another version."""
    try:
        summary = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file} is not valid JSON ({error}): plan again") from None
    except OSError as error:
        raise InputError(unreadable(file, error, "the whole folder of a plan")) from None
    entries = _Entries(file, summary)
    require_format(entries.take("format", int), str(file))
    text = entries.take("machine_file", str)
    if hashlib.sha256(text.encode("utf-8", "replace")).hexdigest() != entries.take(
        "machine_file_sha256", str
    ):
        raise InputError(f"{file}: machine_file was changed: plan again, or give the machine with --machine")
    _require_program(file, entries, summary)
    method = entries.take("method", str)
    if method not in methods():
        raise InputError(f"{file}: the method '{method}' is unknown: use the feedplan that wrote it")
    points = _Entries(file, entries.take("setpoints", dict), "setpoints ")
    events = _Entries(file, entries.take("events", dict), "events ")
    machine = Machine.from_toml(text, f"in {file}", joints_only=True)
    axes = tuple(map(str, points.take("axes", list)))
    count, duration, period = (
        points.take("count", int),
        points.number("duration"),
        points.number("period", positive),
    )
    time, rows = entries.number("time"), {SETPOINTS: (count, duration, period)}
    if KNOTS in summary:
        knots = _Entries(file, entries.take(KNOTS, dict), "knots ")
        rows[KNOTS] = knots.take("count", int), time, knots.number("step", positive)
    # Setpoints add a pause of less than one period to each run, and to the pause before the first run.
    if not time * (1.0 - ROUNDING) <= duration <= time + (entries.take("runs", int) + 1) * period:
        raise InputError(
            f"{file}: the time is {time:.9g} s, its setpoints take {duration:.9g} s: "
            "one of them was changed, plan again"
        )
    return _Plan(
        file=file,
        machine=machine,
        method=method,
        axes=axes,
        rows=rows,
        events={name: events.take(f"sha256_of_{name}", str) for name in (SETPOINTS, KNOTS)},
    )


def _require_program(file: FilePath, entries: _Entries, summary: Mapping[str, Any]) -> None:
    """Raises InputError if the program with planned feeds is not the one of the plan."""
    if summary.get("planned_program") is None:
        return
    told = _Entries(file, entries.take("planned_program", dict), "planned_program ")
    wanted = told.take("sha256", str)
    program = file.parent / PROGRAM_FILE
    try:
        content = program.read_bytes()
    except OSError as error:
        raise InputError(
            f"{program} cannot be read ({(error.strerror or str(error)).lower()}), and {file} tells of it: "
            "plan again"
        ) from None
    if hashlib.sha256(content).hexdigest() != wanted:
        raise InputError(f"{program} was changed, it is not the one of {file}: plan again")


class _Entries:
    """The entries of a table in a file."""

    def __init__(self, file: FilePath, table: Any, place: str = "") -> None:
        if not isinstance(table, Mapping):
            raise InputError(
                f"{file} is not a plan: an object with format, machine_file, … is needed: plan again"
            )
        self._file, self._table, self._place = file, table, place

    def take(self, name: str, kind: type) -> Any:
        """An entry of that type. Raises InputError if it is missing or has another type."""
        value = self._table.get(name)
        if not isinstance(value, kind) or (isinstance(value, int) and not is_number(value)):
            what = "missing" if value is None else shown(value)
            raise InputError(f"{self._file}: {self._place}{name} is {what}: plan again")
        return value

    def number(self, name: str, within: Callable[[float], bool] = not_negative) -> float:
        """An entry that is a number for which `within` is true. Raises InputError for others."""
        value: Any = self._table.get(name)
        if not (is_number(value) and within(value)):
            raise InputError(f"{self._file}: {self._place}{name} is {shown(value)}: plan again")
        return float(value)


def _require_same(plan: _Plan, points: SetpointFile) -> None:
    """Raises InputError unless the setpoints are those that plan.json describes."""
    if points.rows not in plan.rows:
        raise _other(points, plan, "table", f"one of {points.rows}", "nothing of it")
    count, duration, period = plan.rows[points.rows]
    rows: list[tuple[str, Any, Any, str]] = [
        ("axes", " ".join(points.axes), " ".join(plan.axes), ""),
        (f"number of {points.rows}", len(points), count, ""),
        ("period", points.period or period, period, " s"),
    ]
    for what, own, planned, unit in rows:
        if own != planned:
            raise _other(points, plan, what, f"{own}{unit}", f"{planned}{unit}")
    last = float(points.t[-1])
    # The audit reports a time that is not finite, and its row.
    if math.isfinite(last) and abs(last - duration) > ROUNDING * max(duration, period):
        raise _other(points, plan, "last time", f"{last:.9g} s", f"{duration:.9g} s")
    if points.events.sha256() != plan.events[points.rows]:
        raise InputError(
            f"{points.file}: its events are not those that {plan.file} tells of: one of them was changed, "
            "plan again"
        )


def _other(points: SetpointFile, plan: _Plan, what: str, own: str, planned: str) -> InputError:
    return InputError(
        f"{points.file}: the {what} is {own}, {plan.file} says {planned}: these are not the setpoints of "
        "this plan, plan again or move them elsewhere and give the machine with --machine"
    )


def _require_units(points: SetpointFile, machine: Machine) -> None:
    for name, unit in zip(points.axes, points.units, strict=False):
        if name in machine.axis_names and (own := machine.axis(name).unit) != unit:
            raise InputError(
                f"{points.file}: axis {name} is in {unit}, on the machine {machine.name} in {own}: "
                "give the machine that it was planned for"
            )
