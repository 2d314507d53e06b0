"""`feedplan machines`: lists machines, shows the limits of one, writes a template, imports other formats."""

from __future__ import annotations

import math
from itertools import groupby
from pathlib import Path

import click

from feedplan.cli import terminal
from feedplan.cli.options import Place, by_name
from feedplan.errors import InputError
from feedplan.machine.axis import Axis, Limit
from feedplan.machine.machine import Machine, bundled_machines, bundled_text, template


@click.group(invoke_without_command=True)
@click.pass_context
def machines(context: click.Context) -> None:
    """List the bundled machines; show one, begin your own, or import it from your controller's file."""
    if context.invoked_subcommand is None:
        names = ["machine", "axes", "velocity /s", "acceleration /s²", "period ms", "chord mm"]
        terminal.print_table(names, [_machine_row(Machine.load(known)) for known in bundled_machines()])


@machines.command()
@click.argument("name", metavar="NAME|FILE")
def show(name: str) -> None:
    """Show the limits of a bundled machine or of a TOML file, in mm and seconds, rotary axes in degrees."""
    names = ["axis", "unit", "velocity /s", "acceleration /s²", "jerk /s³", "travel"]
    terminal.print_table(names, [_axis_row(axis) for axis in Machine.load(name).axes])


_OUTPUT = click.option(
    "--output", "-o", type=Place(), metavar="FILE", help="File for the machine.  [default: standard output]"
)


@machines.command()
@click.option("--like", metavar="NAME", help="Begin with a bundled machine, such as trunnion-ac.")
@_OUTPUT
def new(like: str | None, output: str | None) -> None:
    """Write a machine file with comments, to be filled with the numbers of your machine."""
    _write(template() if like is None else bundled_text(like), output)


@machines.command("import")
@click.argument("file")
@click.option(
    "--limit",
    "limits",
    multiple=True,
    metavar="AXIS.LIMIT=N",
    help="A velocity, acceleration or jerk, as X.jerk=5000 [mm, deg, s]; may be given several times.",
)
@click.option("--name", metavar="NAME", help="Name of the machine.  [default: the file's]")
@_OUTPUT
def import_(file: str, limits: tuple[str, ...], name: str | None, output: str | None) -> None:
    """Make a machine file of your controller's FILE: LinuxCNC's INI, what grbl prints for $$, Klipper's
    printer.cfg, or joint_limits.yaml of ROS.

    Each number has its source beside it. Limits that FILE lacks are asked for, and given by --limit.
    """
    from feedplan.machine.importers import find_machine
    from feedplan.machine.machine import Machine

    found = find_machine(file, by_name(map(_limit, limits), "--limit"), name=name)
    text = found.to_toml()
    Machine.from_toml(text, found.origin)
    terminal.warn(found.notes())
    _write(text, output)


def _limit(given: str) -> tuple[str, float]:
    key, _, value = given.partition("=")
    try:
        return key.strip(), float(value)
    except ValueError:
        raise click.UsageError(f"--limit {given!r} is no limit: give one such as X.jerk=5000") from None


def _write(text: str, output: str | None) -> None:
    """Writes to standard output or to a new file. An existing file may have been edited by hand: it is kept,
    and InputError is raised."""
    from feedplan.arguments import file_path
    from feedplan.outputs._staging import staged

    if output is None:
        print(text, end="")
        return
    path = file_path(output, "the output", "the path of a file")
    if path.exists() or not path.name:
        raise InputError(f"{output} is there already: choose another name with -o, or remove it")
    with staged(Path(path.parent), last=path.name) as stage:
        (stage / path.name).write_text(text, encoding="utf-8")
    print(output)


def _machine_row(machine: Machine) -> tuple[str, ...]:
    limits = (_by_unit(machine, limit) for limit in ("max_velocity", "max_acceleration"))
    names = machine.axis_names
    axes = ("" if max(map(len, names)) == 1 else " ").join(names)
    return (machine.name, axes, *limits, f"{1e3 * machine.period:g}", _or_none(machine.chord_tolerance))


def _by_unit(machine: Machine, limit: str) -> str:
    """A limit of all axes, with the unit once after consecutive axes that share it: `500 500 mm 150 deg`."""
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
