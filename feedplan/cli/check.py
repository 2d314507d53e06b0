"""`feedplan check`: audits setpoints in files."""

from __future__ import annotations

import click

from feedplan.cli import terminal
from feedplan.cli.ending import BROKEN, DONE, fail
from feedplan.cli.options import JSON, ZERO_OR_MORE


@click.command()
@click.argument("place", metavar="DIR|SETPOINTS")
@click.option(
    "--machine",
    "-m",
    metavar="NAME|FILE",
    help="A bundled machine or a TOML file.  [default: the plan's own]",
)
@click.option(
    "--resolution",
    type=ZERO_OR_MORE,
    default=0.0,
    metavar="MM",
    help="Last digit of the positions, if they were rounded.",
)
@click.option("--jerk", is_flag=True, help="Judge the jerk, whatever the method.")
@JSON
def check(place: str, machine: str | None, resolution: float, jerk: bool, as_json: bool) -> int:
    """Audit setpoints from files alone, against the limits of the machine that plan.json holds.

    Velocity and acceleration are measured by differences of the positions, and so is the jerk if the plan's
    method limits it. Exit code 1: a limit is broken.
    """
    from feedplan.checking import check as check_files

    with terminal.progress_bar(quiet=False) as progress:
        audit = check_files(place, machine, resolution=resolution, jerk=jerk, progress=progress)
    if as_json:
        terminal.print_json(audit.to_json())
    else:
        terminal.print_table(terminal.AUDIT_HEADER, terminal.audit_rows(audit))
    return DONE if audit.ok else fail(terminal.failure_sentence(audit), BROKEN)
