"""`feedplan time`: machining time per tool and operation, by the machine's limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO, Any

import click

from feedplan.cli import options as option
from feedplan.cli import terminal
from feedplan.cli.controller_options import Choice, controller_options
from feedplan.cli.reading_options import machine_for, reading_options
from feedplan.errors import InfeasibleError
from feedplan.program.read import Reading
from feedplan.report.operations import PARTS, OperationTime, by_tool
from feedplan.units import duration_text

# The greatest number of operations in the table: the longest ones are shown.
_SHOWN = 60


@click.command()
@option.PROGRAM
@option.MACHINE
@reading_options
@option.METHOD
@option.ACCURACY
@click.option("--time-limit", type=option.ZERO_OR_MORE, metavar="S", help=option.TIME_LIMIT_HELP)
@option.TOLERANCE
@option.PATH
@option.FEED
@option.FEED_OVERRIDE
@click.option(
    "--tool-change",
    type=option.ZERO_OR_MORE,
    default=0.0,
    show_default=True,
    metavar="S",
    help="Time of a tool change.",
)
@controller_options
@option.JSON
def time(
    program: str | IO[bytes],
    machine: str,
    tool_change: float,
    as_json: bool,
    reading: Reading,
    controller: Choice,
    **options: Any,
) -> None:
    """Machining time of PROGRAM per tool and operation, by the machine's limits.

    Rapids and dwells are included. An operation begins at a comment that is alone in its line. PROGRAM is as
    for plan. --controller adds today's time, without tool changes. Exit code 1: a limit is broken, or no plan
    is feasible.
    """
    from feedplan.planning import plan

    with terminal.progress_bar(quiet=False) as progress, terminal.silenced():
        known, source, reading = machine_for(machine, program, reading, options["feed"])
        result = plan(
            source,
            known,
            reading=reading,
            controller=controller(known),
            progress=progress,
            **option.given_only(**options),
        )
        audit = result.audit(progress)
        operations = result.operations(tool_change)
    tools = by_tool(operations)
    whole = sum(own.time for own in tools)
    terminal.warn(result.warnings)
    if as_json:
        summary = {
            "program": option.name_of(program),
            "machine": known.name,
            "method": result.method,
            "time": whole,
            "audit": audit.ok,
            "today": result.today and result.today.to_json(),
            "tools": [own.to_json() for own in tools],
            "operations": [own.to_json() for own in operations],
        }
        terminal.print_json(summary)
    else:
        terminal.print_table(*_table(tools, operations, whole))
        if result.today:
            print(f"today: {terminal.today_text(result.today.to_json())}")
    if not audit.ok:
        raise InfeasibleError(terminal.failure_sentence(audit))


def _table(
    tools: Sequence[OperationTime], operations: Sequence[OperationTime], whole: float
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Header and rows: each tool, its longest operations below it, and the sum."""
    parts = [part for part in PARTS if part != "change" or any(own.change for own in tools)]

    def row(name: str, rows: Sequence[OperationTime], line: int = 0) -> tuple[str, ...]:
        times = [sum(getattr(own, part) for own in rows) for part in (*parts, "time")]
        share = f"{100 * times[-1] / whole:.1f} %" if whole else "-"
        return (name, str(line or "-"), *(duration_text(time) if time else "-" for time in times), share)

    longest = set(sorted(operations, key=lambda own: -own.time)[:_SHOWN])
    rows = []
    for tool in tools:
        rows.append(row("no tool" if tool.tool is None else f"T{tool.tool}", [tool]))
        own = [each for each in operations if each.tool == tool.tool]
        if any(each.name for each in own):
            rows += [row(f"  {each.name or 'begin'}", [each], each.line) for each in own if each in longest]
    rest = [each for each in operations if each not in longest]
    rows += [row(f"{len(rest)} shorter operations", rest)] if rest else []
    rows.append(row("whole program", tools))
    return ("operation", "line", *parts, "time", "part"), rows
