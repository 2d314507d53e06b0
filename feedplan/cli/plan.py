"""`feedplan plan`: makes one plan on this computer, a cluster or a service, and writes its table and
files."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path as FilePath
from typing import IO, Any

import click
from click.core import ParameterSource

from feedplan import outputs
from feedplan.cli import options as option
from feedplan.cli import terminal
from feedplan.cli.cluster_options import cluster_options
from feedplan.cli.controller_options import Choice, controller_options
from feedplan.cli.ending import BROKEN, DONE, fail
from feedplan.cli.program_options import ProgramWanted, program_options
from feedplan.cli.reading_options import machine_for, reading_options
from feedplan.cli.serve import TOKEN_FILE
from feedplan.jobs.address import ClusterAddress
from feedplan.program.read import Reading
from feedplan.setpoints import INTERPOLATORS


@click.command()
@option.PROGRAM
@option.MACHINE
@controller_options
@reading_options
@option.METHOD
@option.ACCURACY
@click.option("--time-limit", type=option.ZERO_OR_MORE, metavar="S", help=option.WHOLE_LIMIT_HELP)
@option.TOLERANCE
@option.PATH
@option.PATH_ROUNDS
@option.FEED
@option.FEED_OVERRIDE
@option.PERIOD
@click.option("--interpolator", type=click.Choice(INTERPOLATORS), default="sarfraz", show_default=True)
@option.MOST_SETPOINTS
@click.option(
    "--start-speed", type=option.ZERO_OR_MORE, default=0.0, metavar="MM/S", help="Speed at the start."
)
@click.option("--end-speed", type=option.ZERO_OR_MORE, default=0.0, metavar="MM/S", help="Speed at the end.")
@click.option(
    "--one-step-more", is_flag=True, help="Plan again with each limit raised by a step; show the time saved."
)
@click.option(
    "--output",
    "-o",
    type=option.Place(),
    metavar="DIR",
    help="Folder for plan.json, setpoints and report.html.",
)
@click.option(
    "--format",
    "formats",
    type=click.Choice((*outputs.formats(), option.NO_SETPOINTS)),
    multiple=True,
    help="Format of the setpoints (npz by default); may be given several times. none: only plan.json and the "
    "report.",
)
@click.option(
    "--step", type=option.Number(), metavar="S", help="Longest time step of a pvt table, for --format pvt."
)
@program_options
@click.option(
    "--server", metavar="URL", help="Address of a service that makes the plan, such as http://127.0.0.1:8000."
)
@TOKEN_FILE
@cluster_options
@option.JSON
@option.QUIET
def plan(
    program: str | IO[bytes],
    machine: str,
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
    **options: Any,
) -> int:
    """Plan PROGRAM: G-code, a path file (.json) or a drawing (.dxf); - is standard input.

    With --cluster and jerk-limited, the workers of a Dask cluster plan the runs between stops. The result is
    the same bit for bit; reading, fitting, the audit and the files stay on this computer.

    Exit code 1: a limit is broken, or no plan is feasible.
    """
    from feedplan.one_step_more import one_step_more as steps_of
    from feedplan.outputs._staging import require_folder
    from feedplan.plan_folder import files_of_plan
    from feedplan.report.page import missing_pictures

    if formats and not output:
        raise click.UsageError("--format needs a folder to write to: give -o DIR as well")
    option.require_one_or_formats(formats)
    if step is not None and not output:
        raise click.UsageError("--step needs a folder to write to: give -o DIR and --format pvt as well")
    if wanted.in_folder and not output:
        raise click.UsageError("--program needs a folder to write to: give -o DIR, or --program-out FILE")
    if server and (one_step_more or step is not None or wanted.file is not None or wanted.in_folder):
        raise click.UsageError(
            "a service gives no program with planned feeds, no pvt table and nothing of --one-step-more: "
            "leave them out, or --server"
        )
    given = click.get_current_context().get_parameter_source("token_file")
    if given is ParameterSource.COMMANDLINE and not server:
        raise click.UsageError("--token-file needs a service that asks for it: give --server URL as well")
    if server and cluster:
        raise click.UsageError(
            "a service plans where its own --cluster says: leave --server or --cluster out"
        )
    wanted.require_other(machine)
    if output:
        require_folder(FilePath(output))
    with (
        _elsewhere(cluster) as elsewhere,
        terminal.progress_bar(quiet) as progress,
        terminal.silenced(),
    ):
        known, source, reading = machine_for(machine, program, reading, options["feed"])
        make_plan, write = _place(server, token_file)
        result = make_plan(
            source,
            known,
            reading=reading,
            controller=controller(known),
            progress=progress,
            **option.given_only(**options, elsewhere=elsewhere),
        )
        planned = wanted.make(result)
        steps = steps_of(result) if one_step_more else ()
        files: tuple[FilePath, ...] = ()
        if output:
            own = planned if wanted.in_folder else None
            here = {} if server else {"program": own, "step": step, "one_step_more": steps}
            files = write(
                result,
                output,
                () if option.NO_SETPOINTS in formats else formats or ("npz",),
                progress=progress,
                **here,
            )
        audit = result.audit(progress)
    warnings = list(result.warnings)
    if output:
        earlier = (file for file in files_of_plan(FilePath(output)) if file not in files)
        warnings += [f"{file} is of an earlier plan" for file in earlier]
        warnings += filter(None, [missing_pictures()]) if server is None else ()
    if not quiet:
        terminal.warn(warnings)
    if as_json or not quiet:
        more = {"one_step_more": [each.to_json() for each in steps]} if one_step_more else {}
        summary = {**result.summary(), **more}
        if as_json:
            told = {} if planned is None else {"planned_program": planned.to_json()}
            terminal.print_json({**summary, **told})
        else:
            terminal.print_rows(terminal.plan_rows(summary, audit, files))
            if planned is not None:
                print(planned.summary())
    return DONE if audit.ok else fail(terminal.failure_sentence(audit), BROKEN)


def _elsewhere(cluster: ClusterAddress | None) -> AbstractContextManager[Any]:
    """The cluster that plans runs instead of this computer; None without a cluster."""
    if cluster is None:
        return nullcontext()
    from feedplan.jobs.cluster_runs import ClusterRuns

    return ClusterRuns(cluster)


def _place(server: str | None, token_file: str | None) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """The functions that plan and that write a plan: those of this package, or a client's of a service."""
    if server is None:
        from feedplan.plan_folder import write_plan
        from feedplan.planning import plan

        return plan, write_plan
    from feedplan.client.client import Client
    from feedplan.client.token import read_token

    client = Client(server, None if token_file is None else read_token(FilePath(token_file)))
    return client.plan, client.write_plan
