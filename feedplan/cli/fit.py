"""`feedplan fit`: fits a program's points by splines, without a plan."""

from __future__ import annotations

from typing import IO

import click

from feedplan.cli import terminal
from feedplan.cli.options import JSON, MACHINE, PROGRAM, TOLERANCE, name_of
from feedplan.cli.reading_options import machine_for, reading_options
from feedplan.program.read import Reading


@click.command()
@PROGRAM
@MACHINE
@reading_options
@TOLERANCE
@click.option(
    "--smooth", is_flag=True, help="Fit all moves by smooth curves, as for methods that limit jerk."
)
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

    from feedplan.constraints.problem import build_problem
    from feedplan.geometry.build import build_path
    from feedplan.geometry.corners import Corners
    from feedplan.program.program import Program
    from feedplan.program.read import read_program
    from feedplan.progress import of_stage

    known, source, reading = machine_for(machine, program, reading)
    choice = Corners.SMOOTH if smooth else Corners.ROUNDED
    with terminal.progress_bar(quiet=False) as progress:
        moves = source
        if not isinstance(moves, Program):
            moves = read_program(moves, known, progress=of_stage(progress, "read"), **reading)
        path = build_path(moves, known, tolerance, corners=choice, progress=of_stage(progress, "fit"))
    terminal.warn((*moves.warnings, *path.warnings))
    ratios = {"spline_ratio": path.fit.spline_ratio, "polynomial_ratio": path.fit.polynomial_ratio}
    summary = asdict(path.fit) | ratios | {"pieces": len(path), "runs": len(path.runs) - 1}
    if as_json:
        terminal.print_json(summary)
    else:
        unit = build_problem(path, known).unit
        path_row = ("path", terminal.pieces_text(summary))
        terminal.print_rows([("program", name_of(program)), *terminal.fit_rows(summary, unit), path_row])
