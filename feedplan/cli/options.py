"""Arguments and single options that several commands take."""

from __future__ import annotations

import functools
import inspect
import math
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import IO, TYPE_CHECKING, Any, TypeVar

import click

from feedplan import planners
from feedplan.arguments import printable
from feedplan.faster_path import MAX_ROUNDS
from feedplan.geometry.corners import PATHS
from feedplan.setpoints import MAX_SETPOINTS

if TYPE_CHECKING:
    NumberType = click.ParamType[float]
    TextType = click.ParamType[str]
else:
    NumberType = TextType = click.ParamType  # generic only in the newest click

Command = TypeVar("Command", bound=Callable[..., Any])
Value = TypeVar("Value")


class Number(NumberType):
    """A finite number greater than 0; with `or_zero` also 0."""

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


class Place(TextType):
    """The path of a file or a folder to write to."""

    name = "path"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        if value:
            return str(value)
        self.fail("it is empty: give a path", param, ctx)


MACHINE = click.option(
    "--machine",
    "-m",
    default="mill",
    show_default=True,
    metavar="NAME|FILE",
    help="A bundled machine, a TOML file, or auto: the smallest bundled machine that the program fits on.",
)
METHOD = click.option(
    "--method", type=click.Choice(planners.methods()), default="bang-bang", show_default=True
)
FEED = click.option("--feed", type=Number(), metavar="MM/S", help="Feed that replaces all programmed ones.")
FEED_OVERRIDE = click.option(
    "--feed-override", type=Number(), default=1.0, metavar="FACTOR", help="Factor on all programmed feeds."
)
TOLERANCE = click.option(
    "--tolerance", type=Number(), metavar="MM", help="Allowed distance from the programmed path."
)
PATH = click.option(
    "--path",
    type=click.Choice(PATHS),
    default="as-fitted",
    show_default=True,
    help="as-fitted: the path follows from the program alone, and arcs keep their size. fastest: within the "
    "tolerance the path is fitted to the speed of a first plan, wherever this saves time.",
)
PATH_ROUNDS = click.option(
    "--path-rounds",
    type=click.IntRange(1, MAX_ROUNDS),
    default=1,
    show_default=True,
    help="Rounds of --path fastest: the first one fits the path to the speed of a plan, the others make "
    "steps along the gradient of the time.",
)
ACCURACY = click.option(
    "--accuracy", type=Number(), metavar="PART", help="Relative error of the time, for methods with a mesh."
)
TIME_LIMIT_HELP = "Limit of the computing time, for methods with a mesh."
WHOLE_LIMIT_HELP = (
    "Limit of the computing time, for methods with a mesh. With jerk-limited it is the limit of the whole "
    "command: reading, fitting, a first plan, the audit and the files are always done (0 allows only these); "
    "the rest of the time improves the plan and its lower bound."
)
PERIOD = click.option(
    "--period", type=Number(), metavar="S", help="Servo period that replaces the machine's."
)
MOST_SETPOINTS = click.option(
    "--max-setpoints",
    type=click.IntRange(min=1),
    default=MAX_SETPOINTS,
    show_default=True,
    metavar="N",
    help="Refuse plans with more setpoints.",
)
JSON = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
QUIET = click.option("--quiet", "-q", is_flag=True, help="Print only errors and the output of --json.")
PROGRAM = click.argument("program", callback=lambda context, parameter, given: _source(given))
ZERO_OR_MORE = Number(or_zero=True)
# This value of --format means that no setpoints are written.
NO_SETPOINTS = "none"


def _source(given: str) -> str | IO[bytes]:
    """The file of that name, or standard input for `-`."""
    if given != "-":
        return given
    if sys.stdin is None:
        raise click.UsageError("standard input is closed: give the path of a program")
    return sys.stdin.buffer


def as_one(
    name: str, make: Callable[..., Any], options: Sequence[Callable[..., Any]]
) -> Callable[[Command], Command]:
    """Adds options to a command; the command's help lists them in this order.

    The command gets the result of `make(**options)` as one argument of this `name`.
    """
    taken = tuple(inspect.signature(make).parameters)

    def add(command: Command) -> Command:
        @functools.wraps(command)
        def packed(*args: Any, **given: Any) -> Any:
            made = make(**{own: given.pop(own) for own in taken})
            return command(*args, **{name: made}, **given)

        return functools.reduce(lambda made, option: option(made), reversed(options), packed)  # type: ignore[return-value]

    return add


def by_name(pairs: Iterable[tuple[str, Value]], option: str) -> dict[str, Value]:
    """The values by their names. Raises UsageError for a name that is given twice."""
    found: dict[str, Value] = {}
    for name, value in pairs:
        if name in found:
            raise click.UsageError(f"{option} has {name} twice: give it once")
        found[name] = value
    return found


def require_one_or_formats(formats: Sequence[str]) -> None:
    """Raises UsageError if `none` is given together with a format."""
    if NO_SETPOINTS in formats and len(formats) > 1:
        raise click.UsageError(f"--format {NO_SETPOINTS} excludes other formats: leave one of them out")


def name_of(program: str | IO[bytes]) -> str:
    return printable(program) if isinstance(program, str) else program.name


def given_only(**options: Any) -> dict[str, Any]:
    """The options that were given (not None); the method refuses those that it does not take."""
    return {name: value for name, value in options.items() if value is not None}
