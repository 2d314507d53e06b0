"""Makes a plan from a part program: reads it, builds the path, builds the problem, plans the profile, and
provides setpoints."""

from __future__ import annotations

import hashlib
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from feedplan import planners
from feedplan.accuracy import estimate, shortfalls
from feedplan.arguments import callback, not_negative, number, one_of, refuse, whole
from feedplan.audit import CHUNK, Audit, audit
from feedplan.constraints.problem import Problem, build_problem, speed_square
from feedplan.errors import InputError, SolverError, at_line
from feedplan.event_places import PlannedEvents
from feedplan.events import PlacedEvents, TimedEvents
from feedplan.faster_path import MAX_ROUNDS, Followed, Gain, faster
from feedplan.geometry.build import build_path
from feedplan.geometry.corners import PATHS, Corners, FollowedPath
from feedplan.geometry.path import Path
from feedplan.geometry.path_words import path_words
from feedplan.knots import Knots
from feedplan.lazy import cached_property
from feedplan.lower_bound import lower_bound
from feedplan.machine.controller import Controller
from feedplan.machine.machine import Machine
from feedplan.outputs import FORMAT
from feedplan.planners import Elsewhere, MethodName
from feedplan.profile import SpeedProfile
from feedplan.program.program import Program
from feedplan.program.read import Reading, checked_reading, read_program
from feedplan.program.source import Source
from feedplan.progress import Listener, Progress, of_stage, part, tell
from feedplan.refit import FitLimits
from feedplan.report.account import Account, account
from feedplan.report.operations import OperationTime, operation_times
from feedplan.setpoints import INTERPOLATORS, MAX_SETPOINTS, Interpolator, Setpoints, Sink
from feedplan.time_limit import TimeLimit
from feedplan.today import Today, beside_plan
from feedplan.trajectory import State, Trajectory
from feedplan.units import counted

# Share of the stage `plan` that is finished when the profile is known, if the method has no lower bound of
# its own.
PLANNING = 0.6
# Share of the audit that is finished when the times of the setpoints are known.
LAID_OUT = 0.02


@dataclass(frozen=True, eq=False)
class Plan:
    """A planned program.

    `profile` is the speed along `problem.path`. `lower_bound` [s] is proven: no feasible profile of this path
    is faster, but one of another path within the tolerance may be (the lower bound of a method such as
    jerk-limited may hold only on its grid). `compute` is the computing time of each stage [s]; `options` are
    those of the plan; `today` is the time of a controller for the same program, if one was named; `gain` is
    the time saved by a path that is fitted to the speed, if it was requested.
    """

    program: Program | None
    machine: Machine
    problem: Problem
    profile: SpeedProfile
    method: MethodName
    lower_bound: float
    compute: dict[str, float]
    interpolator: Interpolator = "sarfraz"
    max_setpoints: int = MAX_SETPOINTS
    warnings: tuple[str, ...] = field(default=())
    options: Mapping[str, Any] = field(default_factory=dict)
    today: Today | None = None
    gain: Gain | None = None
    _verdict: list[Audit] = field(default_factory=list, init=False, repr=False, compare=False)
    _account: list[Account] = field(default_factory=list, init=False, repr=False, compare=False)

    def __repr__(self) -> str:
        name = self.program.name if self.program else "a path"
        return (
            f"<Plan of {name} on {self.machine.name} by {self.method}: {self.time:.6g} s, "
            f"{self._distance}, {counted(len(self.path), 'piece')}>"
        )

    def _repr_html_(self) -> str:
        from feedplan.report.card import card

        return card(self.figures(), self.trajectory)

    def figures(self) -> dict[str, str]:
        """The key figures by name, as text, for notebooks; with the audit if it was made."""
        verdict = self._verdict[0] if self._verdict else None
        judged = "not made yet" if verdict is None else "every limit holds" if verdict.ok else "failed"
        return {
            "program": self.program.name if self.program else "a path",
            "machine": self.machine.name,
            "method": self.method,
            "time": f"{self.time:.6g} s",
            "no plan within the limits is faster than": f"{self.lower_bound:.6g} s ({self._distance})",
            "path": f"{counted(len(self.path), 'piece')} in {counted(len(self.path.runs) - 1, 'run')}",
            "audit": judged,
            **({"warnings": "; ".join(self.warnings)} if self.warnings else {}),
        }

    @property
    def path(self) -> Path:
        """The path that is followed."""
        return self.problem.path

    @property
    def time(self) -> float:
        """Time of the whole program, including dwells [s]."""
        return self.profile.time + self.path.pauses

    @property
    def gap(self) -> float:
        """(time − lower_bound) / time, an upper bound of the relative distance from the optimum."""
        return (self.time - self.lower_bound) / self.time if self.time > 0 else 0.0

    @property
    def _distance(self) -> str:
        """The gap as text. A plan that is faster than the bound by more than rounding breaks limits."""
        return f"gap {100 * self.gap:.3g} %" if self.gap > -1e-9 else "this one breaks limits"

    def setpoints(
        self,
        period: float | None = None,
        interpolator: Interpolator | None = None,
        progress: Listener | None = None,
    ) -> Setpoints:
        """Setpoints at the servo period [s] (by default the machine's), computed when they are read.

        Where the curvature of the path jumps, third differences keep the jerk limits at the machine's period:
        over a shorter period the same step of the acceleration is a greater jerk. `progress` is called with
        the finished share of computing their times. Raises InputError for a period or an interpolator that
        cannot be used.
        """
        callback(progress, "the part done")
        return Setpoints(
            self.problem,
            self.profile,
            self.machine.period if period is None else period,
            self.interpolator if interpolator is None else interpolator,
            self.max_setpoints,
            progress,
            self._events,
        )

    def knots(self, step: float) -> Knots:
        """States at equal time steps between stops, none longer than `step` [s], on the plan's own clock.

        Raises InputError for a step that cannot be used, or that makes more than `max_setpoints` knots.
        """
        return Knots(self.problem, self.profile, step, self.max_setpoints)

    @cached_property
    def _events(self) -> PlannedEvents | None:
        return None if self.program is None else PlannedEvents(self.program, self.path)

    @cached_property
    def events(self) -> TimedEvents:
        """The events of the program (all actions except moves) in order, on the plan's own clock.

        These are spindle, coolant, tools, dwells, stops, outputs, messages and comments; the table in
        `feedplan.program.actions` also says which of them stop the tool. The others happen when the path
        passes the end of the move before them.
        """
        return TimedEvents.none() if self._placed is None else self._placed.timed()

    @property
    def _placed(self) -> PlacedEvents | None:
        return None if self._events is None else self._events(self.trajectory.sampler)

    @cached_property
    def trajectory(self) -> Trajectory:
        """The plan as functions of time and length."""
        return Trajectory(self.problem, self.profile)

    @property
    def account(self) -> Account:
        """The account of time and distance: limits, slow lines, stops, feed and rapid motion."""
        return self.make_account()

    def make_account(self, progress: Listener | None = None) -> Account:
        """The `account`, computed once; `progress` is called with the finished share."""
        callback(progress, "the part done")
        if not self._account:
            jerk = planners.limits_jerk(self.method)
            self._account.append(account(self.problem, self.profile, self.program, jerk, progress))
        return self._account[0]

    def operations(self, tool_change: float = 0.0) -> tuple[OperationTime, ...]:
        """The time of each tool and operation of the program; a tool change takes `tool_change` [s].

        Raises InputError for the plan of a path, and for a time that is negative or not a number.
        """
        if self.program is None:
            raise InputError("a path has no operations: give a program")
        seconds = number(tool_change, "the time of a tool change", "a time [s] from 0", not_negative, "s")
        return operation_times(self.problem, self.profile, self.program, seconds)

    def at(self, t: ArrayLike) -> State:
        """Exact position, velocity, acceleration, jerk and source line at one time or at times (n,) [s].

        See `Trajectory.at`.
        """
        return self.trajectory.at(t)

    def audit(self, progress: Progress | None = None) -> Audit:
        """The independent check of profile, path and setpoints; computed once.

        `progress("audit", done)` is called with the finished share.
        """
        callback(progress)
        if not self._verdict:
            self.pass_setpoints((), of_stage(progress, "audit"))
        return self._verdict[0]

    @property
    def audited(self) -> bool:
        """Whether the audit has been made."""
        return bool(self._verdict)

    def pass_setpoints(self, sinks: Sequence[Sink], progress: Listener | None = None) -> Audit:
        """Computes the setpoints once, for all `sinks` and, if it has not been made, for the audit.

        The setpoints are passed in chunks of `feedplan.audit.CHUNK`. `progress` is called with the finished
        share. Returns the audit.
        """
        points, rest = self.setpoints(progress=part(progress, 0.0, LAID_OUT)), part(progress, LAID_OUT, 1.0)
        passed = points.teed(sinks)
        if self._verdict:
            done = 0
            for chunk in passed.chunks(CHUNK):
                done += len(chunk)
                tell(rest, done / points.count)
        else:
            start = time.perf_counter()
            verdict = audit(
                self.problem,
                self.profile,
                self.machine,
                self.program,
                passed,
                jerk=planners.limits_jerk(self.method),
                progress=rest,
            )
            whole = time.perf_counter() - start
            self.compute["audit"] = whole - passed.computing - passed.passing
            self._verdict.append(verdict)
        self.compute["sample"] = passed.computing
        return self._verdict[0]

    def summary(self) -> dict[str, Any]:
        """The content of `plan.json`: plain numbers and strings.

        `setpoints` are those of the machine's period. The hashes show whether a text was changed.
        """
        program, verdict = self.program, self.audit()
        points = self.setpoints()
        machine_file = self.machine.to_toml()
        return {
            "format": FORMAT,
            "units": {**dict(zip(("length", "angle"), self.account.motion.units, strict=True)), "time": "s"},
            "time": self.time,
            "lower_bound": self.lower_bound,
            "gap": self.gap,
            "today": self.today and self.today.to_json(),
            "estimated_gap": estimate(self.profile),
            "stopped": self.profile.stopped,
            "method": self.method,
            "options": dict(self.options),
            "machine": self.machine.name,
            "machine_file": machine_file,
            "machine_file_sha256": hashlib.sha256(machine_file.encode()).hexdigest(),
            "program": program.name if program else None,
            "program_sha256": program.sha256 if program else None,
            "setpoints": {
                "axes": list(self.problem.axes),
                "units": list(self.problem.units),
                "period": self.machine.period,
                "count": points.count,
                "duration": points.duration,
            },
            "events": {
                **self.events.counts(),
                "sha256_of_setpoints": points.events.sha256(),
                "sha256_of_knots": self.events.sha256(),
            },
            **self.account.to_json(),
            "pieces": len(self.path),
            "runs": len(self.path.runs) - 1,
            "stops": len(self.path.runs) - 2,
            "fit": asdict(self.path.fit),
            "gain": None if self.gain is None else self.gain.to_json(),
            "compute": dict(self.compute),
            "audit": verdict.to_json(),
            "warnings": list(self.warnings),
        }


def plan(
    source: Source | Program | Path,
    machine: Machine | str | os.PathLike[str],
    method: MethodName = "bang-bang",
    *,
    tolerance: float | None = None,
    feed: float | None = None,
    feed_override: float = 1.0,
    period: float | None = None,
    start_speed: float = 0.0,
    end_speed: float = 0.0,
    interpolator: Interpolator = "sarfraz",
    max_setpoints: int = MAX_SETPOINTS,
    path: FollowedPath = "as-fitted",
    path_rounds: int = 1,
    reading: Reading | None = None,
    controller: Controller | Mapping[str, Any] | str | None = None,
    progress: Progress | None = None,
    elsewhere: Elsewhere | None = None,
    **options: Any,
) -> Plan:
    """Plans a part program on a machine: time-optimal, unless another method is chosen.

    `source`: a file, the text of a program as str or bytes, a stream (see `read_program`), a Program or a
    Path. `machine`: a Machine, or its name or file. `method`: one of `methods()`.

    `tolerance` [mm] is the greatest distance from the programmed path where the program allows the tool to
    leave it (default: the program's own, else 0.01; a Path has its own); the method decides how the path
    follows the program within it. With `path` "as-fitted" the path depends only on the program and the
    tolerance, and arcs and bends keep their size. With "fastest" the program is planned a second time, along
    a smooth path that is fitted to the speed of the first plan: it bends where the tool is slow, and cuts
    corners, arcs and bends as far as the tolerance allows. Each section between two stops follows the faster
    of both paths, and `Plan.gain` is the time saved. Each of the `path_rounds` (1 to 3) after the first fits
    the path again, by a step along the gradient of its time. Such a path depends on machine, feeds and
    method; neighbouring passes may differ by up to twice the tolerance. Methods that follow the programmed
    lines have only one path, and warn if "fastest" is given.

    `feed` [mm/s] replaces the programmed feeds (it is refused for a Path without feeds), `feed_override`
    multiplies them. `reading` are keywords of `read_program`, such as a tool table, for a source that is read
    here. `period` [s] replaces the machine's servo period; `start_speed` and `end_speed` [mm/s] hold at the
    ends. `interpolator` makes the setpoints: "sarfraz" or "newton".

    `controller`: the controller that `Plan.today` compares with (default: that of the machine file):
    "linuxcnc", "grbl", "grblhal", "klipper" or "marlin", or a table as in a machine file. A plan with more
    than `max_setpoints` setpoints cannot give setpoints or an audit; raise this number or the period.

    `progress(stage, done)` is called several times a second with `read`, `fit`, then `plan`, and the finished
    share of that stage, which never decreases; an exception from it ends the work and is raised here.

    `elsewhere`, a `feedplan.jobs.cluster_runs.ClusterRuns`, plans the runs between stops on the workers of a
    cluster, only with jerk-limited; the plan is the same bit for bit.

    Options of some methods, by keyword, with their defaults:

        jerk-limited        accuracy=1e-4, time_limit=None
        casadi, clarabel    accuracy=1e-4, cells=None, time_limit=None
        toppra              accuracy=1e-3, cells=None, time_limit=None, scheme="one-sided"
        ruckig              time_limit=None
        junction-deviation  deviation=0.01, square_corner_velocity=None, axis_jumps=None, blocks=None,
                            arc_tolerance=None, arc_segment=None, short_lines="free", cruise_ratio=0.0,
                            max_velocity=None, max_acceleration=None
        linuxcnc            depth=50, max_velocity=None, max_acceleration=None

    `accuracy` is relative to the time: grids are refined until it is reached, unless `cells` gives the number
    of cells for each piece. After `time_limit` [s] ruckig and jerk-limited return the best plan so far, the
    others raise an error. With jerk-limited the limit is for all work from here to the files: reading,
    fitting, a first plan, audit, setpoints and report are always done (the time of the last three is
    estimated from some setpoints of the first plan), and the rest of the time is for a better plan and its
    bound. `scheme` "collocation" keeps the limits only at the nodes and shows how toppra's usual profiles
    break them. `deviation` [mm] is grbl's setting $11; `square_corner_velocity` [mm/s] (Klipper) or
    `axis_jumps` [mm/s] (Marlin) replace it; the other options are described in `planners.junction_deviation`
    and `planners.linuxcnc`.

    Raises ProgramError, MachineError, InputError, InfeasibleError, SolverError or MissingPackageError, each a
    sentence with place and remedy.
    """
    given = planners.given_options(method, options, OF_ALL_METHODS)
    solve: Callable[..., SpeedProfile] = planners.planner(method, **given)
    if elsewhere is not None:
        _require_parts(elsewhere, method, given.get("time_limit"))
        solve = partial(solve, elsewhere=elsewhere)
    time_limit = given.get("time_limit")
    # If a method can reserve time for the work after its plan, the time limit is for all work.
    early = planners.takes(method, planners.RESERVE)
    limit = TimeLimit(time_limit) if time_limit is not None and early else None
    machine = Machine.of(machine)
    rival = machine.controller if controller is None else Controller.of(controller)
    choice = planners.corners(method)
    refits = one_of(path, "path", PATHS) == "fastest" and choice in (Corners.SMOOTH, Corners.ROUNDED)
    rounds = whole(path_rounds, "path_rounds", f"a whole number from 1 to {MAX_ROUNDS}", most=MAX_ROUNDS)
    if rounds > 1 and path != "fastest":
        raise refuse("path_rounds", rounds, "it with the path fastest, or leave it out")
    if period is not None:
        machine = machine.with_period(period)
    one_of(interpolator, "interpolator", INTERPOLATORS)
    whole(max_setpoints, "max_setpoints", "a whole number from 1")
    callback(progress)
    report = progress or (lambda stage, done: None)
    compute: dict[str, float] = {}
    program: Program | None = None
    gain: Gain | None = None
    speeds: dict[str, Any] = {
        "feed": feed,
        "feed_override": feed_override,
        "start_speed": start_speed,
        "end_speed": end_speed,
    }

    def stated(path: Path) -> Problem:
        return build_problem(path, machine, **speeds)

    reading = reading_of(source, reading)
    if isinstance(source, Path):
        if tolerance is not None:
            raise refuse("the tolerance", tolerance, "it where the path is made: a Path has its own")
        if path != "as-fitted":
            raise refuse("path", path, "it where the path is made: a Path has its own")
        if feed is not None and not np.isfinite(source.feed).any():
            raise refuse("the feed", feed, "it where the path is made: this Path has no feed to replace")
        followed = source
    else:
        report("read", 0.0)
        if isinstance(source, Program):
            program = source
        else:
            with _timed(compute, "read"):
                program = read_program(
                    source,
                    machine,
                    feed=feed,
                    progress=of_stage(progress, "read"),
                    **reading,
                )
        report("read", 1.0)
        report("fit", 0.0)
        with _timed(compute, "fit"):
            followed = build_path(
                program, machine, tolerance, corners=choice, progress=of_stage(progress, "fit")
            )
        report("fit", 1.0)
    share = of_stage(progress, "plan")
    planned = 1.0 if planners.grid_error(method) else PLANNING
    # Each plan has an equal share of the progress.
    each = planned / (1 + rounds if refits else 1)
    turns = count()

    def follow(path: Path) -> Followed:
        problem = stated(path)
        own: dict[str, Any] = {}
        if limit is not None:
            own["time_limit"] = limit.left
            # The time of the work after the plan is estimated from setpoints of a first plan.
            own["reserve"] = lambda first: limit.keep_for(
                Setpoints(problem, first, machine.period, interpolator, max_setpoints)
            )
        if planners.takes(method, planners.PROGRESS):
            turn = next(turns)
            own["progress"] = part(share, turn * each, (turn + 1) * each)
        profile = solve(problem, **own)
        if not math.isfinite(profile.time):
            raise SolverError(f"{method} loses its digits on this path: take another method or machine")
        return Followed(path, problem, profile)

    report("plan", 0.0)
    with _timed(compute, "plan"):
        best = follow(followed)
    if refits and program is not None:
        fit = partial(build_path, program, machine, tolerance, corners=Corners.SMOOTH)
        with _timed(compute, "refit"):
            words = path_words(program, machine)
            jerk = words.max_jerk if planners.limits_jerk(method) else np.full_like(words.max_jerk, np.inf)
            limits = FitLimits(words.max_acceleration, jerk)
            best, gain = faster(best, limits, lambda motion: fit(motion=motion), follow, stated, rounds)
    problem, profile = best.problem, best.profile
    with _timed(compute, "bound"):
        least = profile.lower_bound
        if math.isnan(least):
            least = lower_bound(problem, profile, part(share, planned, 1.0))
        settings = {**planners.options_of(method), **given}
        wanted = settings.get("accuracy", 0.0)
        short = shortfalls(
            profile,
            least,
            accuracy=wanted,
            to_prove="accuracy" in given,
            time_limit=time_limit,
            left_to_grids=wanted * planners.grid_error(method),
        )
        least += best.path.pauses
    beside: Today | None = None
    unknown: tuple[str, ...] = ()
    if rival is not None:
        with _timed(compute, "today"):
            beside, unknown = beside_plan(
                rival, best.time, program or best.path, machine, {"tolerance": tolerance, **speeds}
            )
    report("plan", 1.0)
    return Plan(
        program=program,
        machine=machine,
        problem=problem,
        profile=profile,
        method=method,
        lower_bound=least,
        compute=compute,
        interpolator=interpolator,
        max_setpoints=max_setpoints,
        warnings=(program.warnings if program else ())
        + best.path.warnings
        + _one_path(method, path, refits)
        + short
        + unknown
        + rounding_stops(problem, profile)
        + curvature_jumps(problem, profile),
        options={
            **settings,
            "tolerance": tolerance,
            **speeds,
            "period": period,
            "interpolator": interpolator,
            "path": path,
            "path_rounds": path_rounds,
        },
        today=beside,
        gain=gain,
    )


# The names of the arguments that every method takes.
OF_ALL_METHODS: tuple[str, ...] = tuple(plan.__kwdefaults__ or ())


def reading_of(source: object, reading: object) -> Reading:
    """The keywords of `read_program` for a source; raises InputError for anything else, and for any keywords
    if the source has been read already."""
    given = checked_reading(reading)
    if given and isinstance(source, (Program, Path)):
        kind = type(source).__name__
        raise refuse("reading", ", ".join(given), f"it where the program is read: this {kind} has been read")
    return given


def _require_parts(elsewhere: Any, method: str, time_limit: float | None) -> None:
    """Raises InputError if the runs cannot be planned by `elsewhere`."""
    if not callable(getattr(elsewhere, "map", None)) or not callable(getattr(elsewhere, "count", None)):
        raise refuse("elsewhere", elsewhere, "a feedplan.jobs.cluster_runs.ClusterRuns")
    if not planners.takes(method, planners.ELSEWHERE):
        able = ", ".join(own for own in planners.methods() if planners.takes(own, planners.ELSEWHERE))
        raise InputError(
            f"the method {method} plans in less time than its runs take on the way to a cluster: leave the "
            f"cluster out, or use {able}"
        )
    if time_limit is not None:
        raise InputError("a plan with a time limit is made here: leave the time limit or the cluster out")


def _one_path(method: str, path: str, refits: bool) -> tuple[str, ...]:
    """A sentence if the fastest path was requested and the method has only one path."""
    if path != "fastest" or refits:
        return ()
    return (f"the method {method} knows one path only: the path fastest is the path as-fitted",)


def rounding_stops(problem: Problem, profile: SpeedProfile) -> tuple[str, ...]:
    """A sentence for each line on which the plan stops because of rounding."""
    lines = dict.fromkeys(int(line) for line in problem.path.line[profile.slowed])
    return tuple(
        f"{at_line(line)}rounding hides how the path goes on next to a cusp: the plan stops there, slower "
        "than it need be; a corner in place of the cusp is exact"
        for line in lines
    )


def curvature_jumps(problem: Problem, profile: SpeedProfile) -> tuple[str, ...]:
    """A sentence if jumps of curvature slow a jerk-limited profile: their number, and the slowest place."""
    if not len(profile.kinked):
        return ()
    # The first phase of each piece begins at the jump.
    arc = np.searchsorted(profile.piece, profile.kinked)
    speed_sq = profile.p0[arc] * speed_square(problem, profile.kinked, np.zeros(len(arc)))
    slowest = int(np.argmin(speed_sq))
    line = int(problem.path.line[profile.kinked[slowest]])
    count = len(profile.kinked)
    joints = "1 joint" if count == 1 else f"{count} joints, here the most"
    return (
        f"{at_line(line)}the tool slows to {math.sqrt(speed_sq[slowest]):.3g} {problem.unit}/s where the "
        f"curvature jumps, as it does at {joints}: limits of jerk hold it there; a path of continuous "
        "curvature is faster",
    )


@contextmanager
def _timed(compute: dict[str, float], stage: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        compute[stage] = time.perf_counter() - start
