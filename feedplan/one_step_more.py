"""Computes the time saved by raising each limit by one step: plans again with only that limit raised."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

from feedplan.errors import FeedplanError
from feedplan.machine.axis import Axis
from feedplan.machine.machine import Machine
from feedplan.planners import options_of
from feedplan.planning import Plan, plan

# The factor of a limit, and that of the tolerance.
MORE, TOLERANCE_MORE = 1.2, 2.0
# Limits that are active for a smaller share of the time are left out.
ACTIVE_PART = 0.01


@dataclass(frozen=True)
class Step:
    """With `limit` multiplied by `factor` the plan takes `time` [s], which saves `saved` [s]."""

    limit: str
    factor: float
    time: float
    saved: float

    def to_json(self) -> dict[str, Any]:
        """The numbers by name."""
        return asdict(self)


def one_step_more(made: Plan) -> tuple[Step, ...]:
    """The steps for a plan's limits, the one that saves most first.

    The limits are those that are active for 1 % of the time or more, each multiplied by 1.2, and the
    tolerance of the path, if it has one, doubled. A limit that cannot be raised is left out.
    """
    steps = []
    for limit, factor, changes in _changes(made):
        try:
            again = plan(**{**_request(made), **changes})
        except FeedplanError:
            continue
        steps.append(Step(limit, factor, again.time, made.time - again.time))
    return tuple(sorted(steps, key=lambda step: -step.saved))


def _request(made: Plan) -> dict[str, Any]:
    """The arguments that made the plan; the machine without its controller."""
    shared = ("tolerance", "feed", "feed_override", "start_speed", "end_speed", "path", "path_rounds")
    named = (*shared, *options_of(made.method))
    given = {name: made.options[name] for name in named if made.options.get(name) is not None}
    source: Any = made.program
    if source is None:
        source = made.path
        del given["path"], given["path_rounds"]
    machine = replace(made.machine, controller=None)
    return {"source": source, "machine": machine, "method": made.method, **given}


def _changes(made: Plan) -> Iterator[tuple[str, float, dict[str, Any]]]:
    """Each limit with its factor and the changed arguments."""
    machine = replace(made.machine, controller=None)
    for share in made.account.limits:
        if share.part < ACTIVE_PART:
            continue
        name, _, kind = share.limit.rpartition(" ")
        if share.limit == "feed":
            yield share.limit, MORE, {"feed_override": MORE * made.options["feed_override"]}
        elif share.limit == "chord error":
            wider = replace(machine, chord_tolerance=MORE * machine.chord_tolerance)
            yield share.limit, MORE, {"machine": wider}
        elif kind in ("velocity", "acceleration", "jerk") and name in machine.axis_names:
            yield share.limit, MORE, {"machine": _raised(machine, name, f"max_{kind}")}
    greatest = float(made.path.tolerance.max(initial=0.0))
    if made.program is not None and greatest > 0.0:
        yield "tolerance", TOLERANCE_MORE, {"tolerance": TOLERANCE_MORE * greatest}


def _raised(machine: Machine, name: str, limit: str) -> Machine:
    def more(axis: Axis) -> Axis:
        own = getattr(axis, limit)
        value: Any = tuple(MORE * end for end in own) if isinstance(own, tuple) else MORE * own
        return replace(axis, **{limit: value})

    return replace(machine, axes=tuple(more(axis) if axis.name == name else axis for axis in machine.axes))
