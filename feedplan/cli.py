"""The command line: results on standard output, everything else on standard error.

Exit codes: 0 done, 1 a limit is broken or no plan is feasible, 2 bad input or usage, 70 a defect in feedplan.
What is slow to import is imported by the command that needs it.
"""

from __future__ import annotations

import io
import math
import os
import sys
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path as FilePath
from typing import IO, TYPE_CHECKING, Any

import click

from feedplan import __version__, console, outputs, planners
from feedplan.comparison import TIME_LIMIT
from feedplan.errors import FeedplanError, InfeasibleError, SolverError
from feedplan.geometry.corners import PATHS, FollowedPath
from feedplan.machine.machine import Axis, Limit, Machine, bundled_machines
from feedplan.program.read import Reading
from feedplan.reading_options import machine_for, reading_options
from feedplan.setpoints import INTERPOLATORS, MAX_SETPOINTS, Interpolator

if TYPE_CHECKING:
    NumberType = click.ParamType[float]
else:
    NumberType = click.ParamType  # generic only in the newest click

DONE, BROKEN, BAD_INPUT, DEFECT, INTERRUPTED, PIPE_CLOSED = 0, 1, 2, 70, 130, 141
_TRACEBACK = "FEEDPLAN_TRACEBACK"


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and returns the exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        code = cli.main(arguments, prog_name="feedplan", standalone_mode=False)
        sys.stdout.flush()
        return code if isinstance(code, int) else DONE
    except (click.Abort, KeyboardInterrupt):
        return _fail("interrupted", INTERRUPTED)
    except click.ClickException as error:
        return _fail(_usage(error), BAD_INPUT)
    except BrokenPipeError:
        _close_output()
        return PIPE_CLOSED
    except OSError as error:
        # Files tell their own errors: this one is of the standard output, a full disk for instance.
        _close_output()
        return _fail(
            f"the standard output cannot be written: {(error.strerror or str(error)).lower()}", BAD_INPUT
        )
    except Exception as error:
        if os.environ.get(_TRACEBACK):
            raise
        return _fail(*_explained(error))


def _close_output() -> None:
    """Nothing more is written: what is left would make the interpreter complain while closing."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _explained(error: Exception) -> tuple[str, int]:
    """An error as a sentence and an exit code."""
    if isinstance(error, (InfeasibleError, SolverError)):
        return str(error), BROKEN
    if isinstance(error, FeedplanError):
        return str(error), BAD_INPUT
    if isinstance(error, MemoryError):
        return "the memory of this computer does not suffice: split the program", BAD_INPUT
    what = f"this is a defect in feedplan ({type(error).__name__}: {error})"
    remedy = f"please report it with the command and the program; {_TRACEBACK}=1 shows where it happened"
    return f"{what}: {remedy}", DEFECT


def _fail(sentence: str, code: int) -> int:
    print(f"error: {FeedplanError(' '.join(sentence.split()))}", file=sys.stderr)
    return code


def _usage(error: click.ClickException) -> str:
    command = error.ctx.command_path if isinstance(error, click.UsageError) and error.ctx else "feedplan"
    return f"{error.format_message().rstrip('.')} (`{command} --help` shows the usage)"


class _Number(NumberType):
    """A finite number greater than 0, or also 0."""

    name = "number"

    def __init__(self, or_zero: bool = False) -> None:
        self._or_zero = or_zero

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            number = float(value)
        except ValueError:
            self.fail(f"'{value}' is not a number", param, ctx)
        if math.isfinite(number) and (number > 0 or (self._or_zero and number == 0)):
            return number
        self.fail(f"{value}: give a number {'≥ 0' if self._or_zero else '> 0'}", param, ctx)


_MACHINE = click.option(
    "--machine",
    "-m",
    default="mill",
    show_default=True,
    metavar="NAME|FILE",
    help="A bundled machine, a TOML file, or auto: the smallest bundled one that the program fits.",
)
_TOLERANCE = click.option(
    "--tolerance", type=_Number(), metavar="MM", help="Allowed distance from the programmed path."
)
_PATH = click.option(
    "--path",
    type=click.Choice(PATHS),
    default="as-fitted",
    show_default=True,
    help="Smooth paths keep the size of arcs, or cut them up to the tolerance.",
)
_ACCURACY = click.option(
    "--accuracy", type=_Number(), metavar="PART", help="Relative error of the time, of methods with a mesh."
)
_TIME_LIMIT_HELP = "Time that a method with a mesh may take."
_WHOLE_LIMIT_HELP = (
    "Time that a method with a mesh may take. With jerk-limited it is for the whole command: reading, "
    "fitting, a first plan, the audit and the files are never left out, 0 ends after them; what is left "
    "improves the plan and its bound."
)
_JSON = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
_QUIET = click.option("--quiet", "-q", is_flag=True, help="Print errors only.")
_NO_SETPOINTS = "none"
_PROGRAM = click.argument("program", callback=lambda context, parameter, given: _source(given))
_ZERO_OR_MORE = _Number(or_zero=True)


def _source(given: str) -> str | IO[bytes]:
    """The file of that name, or standard input for `-`."""
    if given != "-":
        return given
    if sys.stdin is None:
        raise click.UsageError("standard input is closed: give the path of a program")
    return sys.stdin.buffer


def _name(program: str | IO[bytes]) -> str:
    return program if isinstance(program, str) else program.name


def _given(**options: Any) -> dict[str, Any]:
    """The options that were given: which of them a method takes is for the method to say."""
    return {name: value for name, value in options.items() if value is not None}


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    invoke_without_command=True,
)
@click.version_option(__version__, message="%(prog)s %(version)s")
@click.pass_context
def cli(context: click.Context) -> int:
    """Time-optimal speed along the exact tool path of a part program, with proof and audit."""
    if context.invoked_subcommand is None:
        print(context.get_help(), file=sys.stderr)
        return BAD_INPUT
    return DONE


@cli.command()
@_PROGRAM
@_MACHINE
@reading_options
@click.option("--method", type=click.Choice(planners.methods()), default="bang-bang", show_default=True)
@_ACCURACY
@click.option("--time-limit", type=_ZERO_OR_MORE, metavar="S", help=_WHOLE_LIMIT_HELP)
@_TOLERANCE
@_PATH
@click.option("--feed", type=_Number(), metavar="MM/S", help="Feed in place of the programmed one.")
@click.option("--feed-override", type=_Number(), default=1.0, metavar="FACTOR", help="Factor on the feed.")
@click.option("--period", type=_Number(), metavar="S", help="Servo period in place of the machine's.")
@click.option("--interpolator", type=click.Choice(INTERPOLATORS), default="sarfraz", show_default=True)
@click.option(
    "--max-setpoints",
    type=click.IntRange(min=1),
    default=MAX_SETPOINTS,
    show_default=True,
    metavar="N",
    help="A plan of more setpoints is refused.",
)
@click.option("--start-speed", type=_ZERO_OR_MORE, default=0.0, metavar="MM/S", help="Speed at the start.")
@click.option("--end-speed", type=_ZERO_OR_MORE, default=0.0, metavar="MM/S", help="Speed at the end.")
@click.option("--output", "-o", metavar="DIR", help="Write plan.json, setpoints and report.html there.")
@click.option(
    "--format",
    "formats",
    type=click.Choice((*outputs.formats(), _NO_SETPOINTS)),
    multiple=True,
    help="Format of the setpoints, npz by default; may be given several times. none: a report without them.",
)
@_JSON
@_QUIET
def plan(
    program: str | IO[bytes],
    machine: str,
    method: planners.MethodName,
    accuracy: float | None,
    time_limit: float | None,
    tolerance: float | None,
    path: FollowedPath,
    feed: float | None,
    feed_override: float,
    period: float | None,
    interpolator: Interpolator,
    max_setpoints: int,
    start_speed: float,
    end_speed: float,
    output: str | None,
    formats: tuple[Any, ...],
    as_json: bool,
    quiet: bool,
    reading: Reading,
) -> int:
    """Plan PROGRAM: G-code, a path file (.json) or a drawing (.dxf); - is standard input.

    Exit code 1: a limit is broken, or no plan is feasible.
    """
    from feedplan.files import summary_text, write_plan
    from feedplan.outputs._staging import require_folder
    from feedplan.planning import plan as make_plan
    from feedplan.report.page import missing_pictures

    if formats and not output:
        raise click.UsageError("--format needs a folder to write to: give -o DIR as well")
    if _NO_SETPOINTS in formats and len(formats) > 1:
        raise click.UsageError(f"--format {_NO_SETPOINTS} excludes other formats: leave one of them out")
    if output:
        require_folder(FilePath(output))
    with console.progress_bar(quiet) as progress, console.without_others():
        known, source = machine_for(machine, program, reading, feed)
        result = make_plan(
            source,
            known,
            method=method,
            tolerance=tolerance,
            path=path,
            feed=feed,
            feed_override=feed_override,
            period=period,
            start_speed=start_speed,
            end_speed=end_speed,
            interpolator=interpolator,
            max_setpoints=max_setpoints,
            reading=reading,
            progress=progress,
            **_given(accuracy=accuracy, time_limit=time_limit),
        )
        audit = result.audit(progress)
        files: tuple[FilePath, ...] = ()
        if output:
            files = write_plan(
                result,
                output,
                () if _NO_SETPOINTS in formats else formats or ("npz",),
                progress=progress,
            )
    warnings = list(result.warnings)
    if output:
        earlier = (file for file in outputs.files_in(FilePath(output)) if file not in files)
        warnings += [f"{file} is of an earlier plan" for file in earlier]
        warnings += filter(None, [missing_pictures()])
    if not quiet:
        for warning in warnings:
            print(f"warning: {warning}", file=sys.stderr)
        if as_json:
            sys.stdout.write(summary_text(result.summary()))
        else:
            console.print_rows(console.plan_rows(result.summary(), audit, files))
    return DONE if audit.ok else _fail(console.failure_sentence(audit), BROKEN)


@cli.command()
@_PROGRAM
@_MACHINE
@reading_options
@click.option("--methods", metavar="A,B,…", help="Methods to compare.  [default: all]")
@_ACCURACY
@click.option(
    "--time-limit", type=_Number(), default=TIME_LIMIT, show_default=True, metavar="S", help=_TIME_LIMIT_HELP
)
@_TOLERANCE
@_PATH
@click.option("--feed", type=_Number(), metavar="MM/S", help="Feed in place of the programmed one.")
@click.option("--period", type=_Number(), metavar="S", help="Servo period in place of the machine's.")
@click.option("--output", "-o", metavar="DIR", help="Write comparison.json and comparison.html there.")
@_JSON
@_QUIET
def compare(
    program: str | IO[bytes],
    machine: str,
    methods: str | None,
    accuracy: float | None,
    time_limit: float,
    tolerance: float | None,
    path: FollowedPath,
    feed: float | None,
    period: float | None,
    output: str | None,
    as_json: bool,
    quiet: bool,
    reading: Reading,
) -> int:
    """Plan PROGRAM by several methods: time, proven gap, computing time, and what the audit says of each.

    PROGRAM is as for plan. Exit code 0 if any method has a plan, whether or not its limits hold: that is what
    the table tells.
    """
    from feedplan.comparison import LIMITS
    from feedplan.comparison import compare as make_comparison
    from feedplan.files import summary_text, write_comparison
    from feedplan.outputs._staging import require_folder
    from feedplan.report.page import missing_pictures

    if output:
        require_folder(FilePath(output))
    names: Any = None if methods is None else [name.strip() for name in methods.split(",")]
    with console.progress_bar(quiet) as progress, console.without_others():
        known, source = machine_for(machine, program, reading, feed)
        rows = make_comparison(
            source,
            known,
            names,
            time_limit=time_limit,
            reading=reading,
            progress=progress,
            tolerance=tolerance,
            path=path,
            feed=feed,
            period=period,
            **_given(accuracy=accuracy),
        )
        summary = {
            "program": _name(program),
            "machine": known.name,
            "methods": [row.to_json() for row in rows],
        }
        files = write_comparison(rows, output, summary, progress) if output else ()
    if not quiet:
        for row in rows:
            if row.error:
                print(f"{row.method}: {row.error}", file=sys.stderr)
        if output and (missing := missing_pictures()):
            print(f"warning: {missing}", file=sys.stderr)
        if as_json:
            sys.stdout.write(summary_text(summary))
        else:
            console.print_table(*console.comparison_table(rows, LIMITS))
            for file in files:
                print(file)
    return DONE if any(row.plan for row in rows) else BROKEN


@cli.command()
@_PROGRAM
@_MACHINE
@reading_options
@_TOLERANCE
@click.option("--smooth", is_flag=True, help="Fit all moves by curves fit for limits of jerk.")
@_JSON
def fit(
    program: str | IO[bytes],
    machine: str,
    tolerance: float | None,
    smooth: bool,
    as_json: bool,
    reading: Reading,
) -> None:
    """Fit PROGRAM's points by splines, without planning; PROGRAM is as for plan."""
    from dataclasses import asdict

    from feedplan.files import summary_text
    from feedplan.geometry.build import build_path
    from feedplan.geometry.corners import Corners
    from feedplan.program.program import Program
    from feedplan.program.read import read_program
    from feedplan.progress import of_stage

    known, source = machine_for(machine, program, reading)
    choice = Corners.SMOOTH if smooth else Corners.ROUNDED
    with console.progress_bar(quiet=False) as progress:
        moves = source
        if not isinstance(moves, Program):
            moves = read_program(moves, known, progress=of_stage(progress, "read"), **reading)
        path = build_path(moves, known, tolerance, corners=choice, progress=of_stage(progress, "fit"))
    for warning in path.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    ratios = {"spline_ratio": path.fit.spline_ratio, "polynomial_ratio": path.fit.polynomial_ratio}
    summary = asdict(path.fit) | ratios | {"pieces": len(path), "runs": len(path.runs) - 1}
    if as_json:
        sys.stdout.write(summary_text(summary))
    else:
        path_row = ("path", console.pieces_text(summary))
        console.print_rows([("program", _name(program)), *console.fit_rows(summary), path_row])


@cli.command()
@click.argument("place", metavar="DIR|SETPOINTS")
@click.option(
    "--machine",
    "-m",
    metavar="NAME|FILE",
    help="A bundled machine or a TOML file.  [default: the plan's own]",
)
@click.option(
    "--resolution", type=_ZERO_OR_MORE, default=0.0, metavar="MM", help="Last digit of rounded positions."
)
@click.option("--jerk", is_flag=True, help="Judge jerk whatever the method.")
@_JSON
def check(place: str, machine: str | None, resolution: float, jerk: bool, as_json: bool) -> int:
    """Audit setpoints from files alone, against the limits of the machine that plan.json holds.

    Positions, velocities and accelerations are measured by differences alone, and so is the jerk where the
    plan's method limits it. Exit code 1: a limit is broken.
    """
    from feedplan.checking import check as check_files
    from feedplan.files import summary_text

    with console.progress_bar(quiet=False) as progress:
        audit = check_files(place, machine, resolution=resolution, jerk=jerk, progress=progress)
    if as_json:
        sys.stdout.write(summary_text(audit.to_json()))
    else:
        console.print_table(console.AUDIT_HEADER, console.audit_rows(audit))
    return DONE if audit.ok else _fail(console.failure_sentence(audit), BROKEN)


@cli.command()
@click.argument("name", required=False)
def machines(name: str | None) -> None:
    """Show the bundled machines, or the limits of one.

    NAME is a bundled machine or a TOML file. Limits are in mm on linear and in degrees on rotary axes.
    """
    if name is None:
        names = ["machine", "axes", "velocity /s", "acceleration /s²", "period ms", "chord mm"]
        console.print_table(names, [_machine_row(Machine.load(known)) for known in bundled_machines()])
    else:
        names = ["axis", "unit", "velocity /s", "acceleration /s²", "jerk /s³", "travel"]
        console.print_table(names, [_axis_row(axis) for axis in Machine.load(name).axes])


def _machine_row(machine: Machine) -> tuple[str, ...]:
    limits = (_by_unit(machine, limit) for limit in ("max_velocity", "max_acceleration"))
    names = machine.axis_names
    axes = ("" if max(map(len, names)) == 1 else " ").join(names)
    return (machine.name, axes, *limits, f"{1e3 * machine.period:g}", _or_none(machine.chord_tolerance))


def _by_unit(machine: Machine, limit: str) -> str:
    """A limit of all axes, with a unit after the last of those that have it: `500 500 mm 150 deg`."""
    groups = groupby(machine.axes, key=lambda axis: axis.unit)
    return " ".join(
        " ".join((*(_limit_text(getattr(axis, limit)) for axis in axes), unit)) for unit, axes in groups
    )


def _axis_row(axis: Axis) -> tuple[str, ...]:
    limits = (axis.max_velocity, axis.max_acceleration, axis.max_jerk)
    travel = " to ".join(f"{end:g}" for end in axis.travel) if math.isfinite(axis.travel[0]) else "-"
    return (axis.name, axis.unit, *(_limit_text(limit) for limit in limits), travel)


def _limit_text(limit: Limit) -> str:
    """`500`, or `-300..500` where it differs by direction."""
    return "..".join(f"{end:g}" for end in limit) if isinstance(limit, tuple) else _or_none(limit)


def _or_none(limit: float) -> str:
    return f"{limit:g}" if math.isfinite(limit) else "-"
