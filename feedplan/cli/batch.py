"""`feedplan batch`: many programs or a sweep, in processes of this computer or on a cluster."""

from __future__ import annotations

import os
import sys
import time
from contextlib import closing
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

import click

from feedplan import outputs, planners
from feedplan.cli import options as option
from feedplan.cli import terminal
from feedplan.cli.cluster_options import cluster_options
from feedplan.cli.ending import BROKEN, DONE
from feedplan.cli.reading_options import reading_options
from feedplan.jobs.address import ClusterAddress
from feedplan.program.read import Reading, checked_reading
from feedplan.program.source import require_other
from feedplan.program.subprograms import readable_folder
from feedplan.program.tools import read_tools
from feedplan.units import counted, duration_text

if TYPE_CHECKING:
    from feedplan.jobs.executor import Executor, JobLimits

# Part of the help text of options that can be swept.
_SWEPT = "may be given several times"


@click.command()
@click.argument("programs", metavar="PROGRAM...", nargs=-1, required=True)
@click.option(
    "--machine",
    "-m",
    "machines",
    multiple=True,
    default=("mill",),
    show_default=True,
    metavar="NAME|FILE",
    help=f"A bundled machine, a TOML file, or auto; {_SWEPT}.",
)
@click.option(
    "--tolerance",
    "tolerances",
    multiple=True,
    type=option.Number(),
    metavar="MM",
    help=f"Allowed distance from the programmed path; {_SWEPT}.",
)
@click.option(
    "--method",
    "methods",
    multiple=True,
    type=click.Choice(planners.methods()),
    default=("bang-bang",),
    show_default=True,
    help=f"{_SWEPT[:1].upper()}{_SWEPT[1:]}.",
)
@reading_options
@option.ACCURACY
@click.option("--time-limit", type=option.ZERO_OR_MORE, metavar="S", help=option.TIME_LIMIT_HELP)
@option.PATH
@option.FEED
@option.FEED_OVERRIDE
@option.PERIOD
@option.MOST_SETPOINTS
@click.option(
    "--output",
    "-o",
    type=option.Place(),
    required=True,
    metavar="DIR",
    help="Folder that gets a folder for each plan.",
)
@click.option(
    "--format",
    "formats",
    type=click.Choice([*(name for name in outputs.formats() if name != "pvt"), option.NO_SETPOINTS]),
    multiple=True,
    help=f"Format of the setpoints (npz by default); {_SWEPT}. none: no setpoints.",
)
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Processes on this computer.  [default: as many as it has cores]",
)
@cluster_options
@click.option(
    "--max-time",
    type=option.Number(),
    default=3600.0,
    show_default=True,
    metavar="S",
    help="Time limit of each plan.",
)
@click.option(
    "--max-memory",
    type=option.Number(),
    default=8000.0,
    show_default=True,
    metavar="MB",
    help="Memory limit of each process on this computer; workers of a cluster have their own limits.",
)
@option.JSON
@option.QUIET
def batch(
    programs: tuple[str, ...],
    machines: tuple[str, ...],
    tolerances: tuple[float, ...],
    methods: tuple[planners.MethodName, ...],
    output: str,
    formats: tuple[Any, ...],
    jobs: int | None,
    cluster: ClusterAddress | None,
    max_time: float,
    max_memory: float,
    as_json: bool,
    quiet: bool,
    reading: Reading,
    **options: Any,
) -> int:
    """Plan every PROGRAM on every machine, at every tolerance, by every method.

    DIR gets a folder for each plan, as plan -o writes it, and batch.csv and batch.json with a row for each. A
    program that cannot be planned is a row with the reason; the others are planned. A batch that was stopped
    continues when it is started again: plans whose program, machine, options and feedplan are the same are
    kept, failed plans are tried again.

    Plans are made by processes of this computer, or with --cluster by the workers of a Dask cluster; both
    give the same files bit for bit. Exit code 1: a limit is broken, or a program has no plan.
    """
    from feedplan.batch.run import run_batch
    from feedplan.batch.summary import HEADER, summary_of, table_rows, write_summary
    from feedplan.batch.sweep import JOURNAL, SUMMARY, TABLE, Sweep, machine_text
    from feedplan.jobs.executor import JobLimits

    if cluster is not None and jobs is not None:
        raise click.UsageError("--jobs is for processes of this computer: leave out --jobs or --cluster")
    option.require_one_or_formats(formats)
    table, folders = reading.pop("tool_table", None), reading.pop("subprograms", ())
    if table is not None:
        read_tools(FilePath(table))
    for name in folders:
        readable_folder(FilePath(name))
    sweep = Sweep(
        list(dict.fromkeys(map(FilePath, programs))),
        [machine_text(name) for name in dict.fromkeys(machines)],
        tuple(dict.fromkeys(tolerances)) or (None,),
        tuple(dict.fromkeys(methods)),
        option.given_only(**options),
        checked_reading(reading),
        () if option.NO_SETPOINTS in formats else formats or ("npz",),
        None if table is None else FilePath(table).absolute(),
        tuple(FilePath(folder).absolute() for folder in folders),
    )
    folder, start = FilePath(output).absolute(), time.monotonic()
    for program in programs:
        require_other(program, *(folder / name for name in (JOURNAL, TABLE, SUMMARY)))
    executor = _executor(cluster, jobs, JobLimits(max_time, max_memory))
    with closing(executor), terminal.progress_bar(quiet) as progress:
        rows, kept = run_batch(sweep, folder, executor, progress)
    summary = summary_of(rows, kept, time.monotonic() - start)
    files = write_summary(summary, folder)
    if not quiet:
        for row in rows:
            errors = [] if row["error"] is None else [row["error"]]
            for told in (*(f"warning: {text}" for text in row["warnings"]), *errors, *row["failures"]):
                print(f"{row['folder']}: {told}", file=sys.stderr)
    if as_json:
        terminal.print_json(summary)
    elif not quiet:
        terminal.print_table(HEADER, table_rows(rows))
        before = f", {kept} of them before" if kept else ""
        print(f"{counted(len(rows), 'plan')} in {duration_text(summary['seconds'])}{before}")
        for file in files:
            print(file)
    return BROKEN if any(row["error"] is not None or not row["ok"] for row in rows) else DONE


def _executor(cluster: ClusterAddress | None, jobs: int | None, limits: JobLimits) -> Executor:
    """The processes of this computer, or the cluster, on which plans are made."""
    if cluster is None:
        from feedplan.jobs.processes import Processes

        return Processes(jobs or os.cpu_count() or 1, limits, niceness=0, grace=0.2)
    from feedplan.jobs.cluster import Cluster

    executor = Cluster(cluster, limits)
    if executor.threads() == 0:
        terminal.warn([f"the cluster at {cluster.url} has no workers yet: waiting"])
    return executor
