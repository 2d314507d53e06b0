"""The command line: results on standard output, everything else on standard error.

Exit codes: 0 done, 1 a limit is broken or no plan is feasible, 2 bad input or usage, 70 a defect in feedplan.
What is slow to import is imported by the command that needs it.
"""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path as FilePath
from typing import IO, Any

import click

from feedplan import __version__, console, outputs, planners
from feedplan.batch_command import batch
from feedplan.cluster_options import cluster_options
from feedplan.command_options import (
    ACCURACY,
    FEED,
    FEED_OVERRIDE,
    JSON,
    MACHINE,
    METHOD,
    PATH,
    PROGRAM,
    QUIET,
    TIME_LIMIT_HELP,
    TOLERANCE,
    WHOLE_LIMIT_HELP,
    ZERO_OR_MORE,
    Number,
    given_only,
    name_of,
)
from feedplan.comparison import TIME_LIMIT
from feedplan.controller_options import Choice, controller_options
from feedplan.errors import FeedplanError, InfeasibleError, SolverError
from feedplan.filter_command import filter_
from feedplan.geometry.corners import FollowedPath
from feedplan.jobs.address import ClusterAddress
from feedplan.machine_commands import machines
from feedplan.program.read import Reading
from feedplan.program_options import ProgramWanted, program_options
from feedplan.reading_options import machine_for, reading_options
from feedplan.service.command import TOKEN_FILE, serve
from feedplan.setpoints import INTERPOLATORS, MAX_SETPOINTS, Interpolator
from feedplan.time_command import time
from feedplan.units import duration_text

DONE, BROKEN, BAD_INPUT, DEFECT, INTERRUPTED, PIPE_CLOSED = 0, 1, 2, 70, 130, 141
_TRACEBACK = "FEEDPLAN_TRACEBACK"
_NO_SETPOINTS = "none"


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
@PROGRAM
@MACHINE
@controller_options
@reading_options
@METHOD
@ACCURACY
@click.option("--time-limit", type=ZERO_OR_MORE, metavar="S", help=WHOLE_LIMIT_HELP)
@TOLERANCE
@PATH
@FEED
@FEED_OVERRIDE
@click.option("--period", type=Number(), metavar="S", help="Servo period in place of the machine's.")
@click.option("--interpolator", type=click.Choice(INTERPOLATORS), default="sarfraz", show_default=True)
@click.option(
    "--max-setpoints",
    type=click.IntRange(min=1),
    default=MAX_SETPOINTS,
    show_default=True,
    metavar="N",
    help="A plan of more setpoints is refused.",
)
@click.option("--start-speed", type=ZERO_OR_MORE, default=0.0, metavar="MM/S", help="Speed at the start.")
@click.option("--end-speed", type=ZERO_OR_MORE, default=0.0, metavar="MM/S", help="Speed at the end.")
@click.option("--one-step-more", is_flag=True, help="Plan again with each limit raised, and tell the gain.")
@click.option("--output", "-o", metavar="DIR", help="Write plan.json, setpoints and report.html there.")
@click.option(
    "--format",
    "formats",
    type=click.Choice((*outputs.formats(), _NO_SETPOINTS)),
    multiple=True,
    help="Format of the setpoints, npz by default; may be given several times. none: a report without them.",
)
@click.option("--step", type=Number(), metavar="S", help="Longest step of a pvt table, which needs it.")
@program_options
@click.option("--server", metavar="URL", help="Have a service plan, such as http://127.0.0.1:8000.")
@TOKEN_FILE
@cluster_options
@JSON
@QUIET
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
    one_step_more: bool,
    output: str | None,
    formats: tuple[Any, ...],
    step: float | None,
    server: str | None,
    token_file: str | None,
    cluster: ClusterAddress | None,
    as_json: bool,
    quiet: bool,
    controller: Choice,
    reading: Reading,
    wanted: ProgramWanted,
) -> int:
    """Plan PROGRAM: G-code, a path file (.json) or a drawing (.dxf); - is standard input.

    With --cluster and jerk-limited the workers of a Dask cluster plan the runs between stops, bit for bit as
    this computer would; reading, fitting, the audit and the files stay here.

    Exit code 1: a limit is broken, or no plan is feasible.
    """
    from feedplan.files import files_of_plan, summary_text
    from feedplan.outputs._staging import require_folder
    from feedplan.report.page import missing_pictures

    if formats and not output:
        raise click.UsageError("--format needs a folder to write to: give -o DIR as well")
    if _NO_SETPOINTS in formats and len(formats) > 1:
        raise click.UsageError(f"--format {_NO_SETPOINTS} excludes other formats: leave one of them out")
    if server and (one_step_more or step is not None or wanted.file is not None or wanted.in_folder):
        raise click.UsageError(
            "a service gives no program with planned feeds, no pvt table and nothing of --one-step-more: "
            "leave them out, or --server"
        )
    if server and cluster:
        raise click.UsageError(
            "a service plans where its own --cluster says: leave --server or --cluster out"
        )
    if output:
        require_folder(FilePath(output))
    with (
        _elsewhere(cluster) as elsewhere,
        console.progress_bar(quiet) as progress,
        console.without_others(),
    ):
        known, source = machine_for(machine, program, reading, feed)
        make_plan, write = _place(server, token_file)
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
            controller=controller(known),
            progress=progress,
            **given_only(accuracy=accuracy, time_limit=time_limit, elsewhere=elsewhere),
        )
        audit = result.audit(progress)
        planned = wanted.make(result)
        steps = _steps(result) if one_step_more else ()
        files: tuple[FilePath, ...] = ()
        if output:
            own = planned if wanted.in_folder else None
            here = {} if server else {"program": own, "step": step, "one_step_more": steps}
            files = write(
                result,
                output,
                () if _NO_SETPOINTS in formats else formats or ("npz",),
                progress=progress,
                **here,
            )
    warnings = list(result.warnings)
    if output:
        earlier = (file for file in files_of_plan(FilePath(output)) if file not in files)
        warnings += [f"{file} is of an earlier plan" for file in earlier]
        warnings += filter(None, [missing_pictures()]) if server is None else ()
    if not quiet:
        for warning in warnings:
            print(f"warning: {warning}", file=sys.stderr)
        more = {"one_step_more": [each.to_json() for each in steps]} if one_step_more else {}
        summary = {**result.summary(), **more}
        if as_json:
            told = {} if planned is None else {"planned_program": planned.to_json()}
            sys.stdout.write(summary_text({**summary, **told}))
        else:
            console.print_rows(console.plan_rows(summary, audit, files))
            if planned is not None:
                print(planned.summary())
    return DONE if audit.ok else _fail(console.failure_sentence(audit), BROKEN)


def _steps(made: Any) -> tuple[Any, ...]:
    """What one step more of each limit would bring."""
    from feedplan.one_step_more import one_step_more

    return one_step_more(made)


def _elsewhere(cluster: ClusterAddress | None) -> AbstractContextManager[Any]:
    """Who plans runs in place of this computer, None for nobody."""
    if cluster is None:
        return nullcontext()
    from feedplan.jobs.cluster_runs import ClusterRuns

    return ClusterRuns(cluster)


def _place(server: str | None, token_file: str | None) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """What plans and what writes plans: here, or on a service."""
    if server is None:
        from feedplan.files import write_plan
        from feedplan.planning import plan

        return plan, write_plan
    from feedplan.client.client import Client
    from feedplan.client.token import read_token

    client = Client(server, None if token_file is None else read_token(FilePath(token_file)))
    return client.plan, client.write_plan


@cli.command()
@PROGRAM
@MACHINE
@controller_options
@reading_options
@click.option("--methods", metavar="A,B,…", help="Methods to compare.  [default: all]")
@ACCURACY
@click.option(
    "--time-limit", type=Number(), default=TIME_LIMIT, show_default=True, metavar="S", help=TIME_LIMIT_HELP
)
@TOLERANCE
@PATH
@FEED
@click.option("--period", type=Number(), metavar="S", help="Servo period in place of the machine's.")
@click.option("--output", "-o", metavar="DIR", help="Write comparison.json and comparison.html there.")
@JSON
@QUIET
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
    controller: Choice,
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
            controller=controller(known),
            progress=progress,
            tolerance=tolerance,
            path=path,
            feed=feed,
            period=period,
            **given_only(accuracy=accuracy),
        )
        today = next((row.plan.today for row in rows if row.plan and row.plan.today), None)
        summary = {
            "program": name_of(program),
            "machine": known.name,
            "today": today and today.of_controller(),
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
            if today:
                print(f"today: {duration_text(today.time)} by {today.controller.name}")
            for file in files:
                print(file)
    return DONE if any(row.plan for row in rows) else BROKEN


@cli.command()
@PROGRAM
@MACHINE
@reading_options
@TOLERANCE
@click.option("--smooth", is_flag=True, help="Fit all moves by curves fit for limits of jerk.")
@JSON
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
        console.print_rows([("program", name_of(program)), *console.fit_rows(summary), path_row])


@cli.command()
@click.argument("place", metavar="DIR|SETPOINTS")
@click.option(
    "--machine",
    "-m",
    metavar="NAME|FILE",
    help="A bundled machine or a TOML file.  [default: the plan's own]",
)
@click.option(
    "--resolution", type=ZERO_OR_MORE, default=0.0, metavar="MM", help="Last digit of rounded positions."
)
@click.option("--jerk", is_flag=True, help="Judge jerk whatever the method.")
@JSON
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


cli.add_command(batch)
cli.add_command(filter_)
cli.add_command(machines)
cli.add_command(serve)
cli.add_command(time)
