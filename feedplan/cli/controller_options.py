"""Options of the command line that name the controller of today and its parameters."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import click

from feedplan.cli.options import with_options
from feedplan.errors import MachineError
from feedplan.machine.controller import MODELS, Controller
from feedplan.machine.machine import Machine

Command = TypeVar("Command", bound=Callable[..., Any])
# Makes the controller that the command line names, for a machine; None without a controller.
Choice = Callable[[Machine], Controller | None]

_OPTIONS = (
    click.option(
        "--controller",
        type=click.Choice(tuple(MODELS)),
        help="Tell the time that this controller takes today.  [default: the machine file's, if any]",
    ),
    click.option(
        "--controller-option",
        "controller_options",
        multiple=True,
        metavar="NAME=VALUE",
        help="A parameter of the controller, such as junction_deviation=0.02; may be given several times.",
    ),
)


def controller_options(command: Command) -> Command:
    """Adds the options; the command gets them as one argument, `controller`, a `Choice`."""

    @functools.wraps(command)
    def packed(*args: Any, controller: str | None, controller_options: tuple[str, ...], **others: Any) -> Any:
        given = dict(map(_pair, controller_options))
        return command(*args, controller=lambda machine: chosen(machine, controller, given), **others)

    return with_options(packed, _OPTIONS)  # type: ignore[no-any-return]


def chosen(machine: Machine, name: str | None, parameters: dict[str, Any]) -> Controller | None:
    """The controller of that name with these parameters, added to the machine's if its controller has this
    name.

    Raises MachineError for parameters without a controller.
    """
    own = machine.controller
    if name is None and own is None:
        if parameters:
            raise MachineError("--controller-option needs a controller: give --controller NAME as well")
        return None
    if own is not None and name in (None, own.name):
        return Controller(own.name, {**own.parameters, **parameters})
    return Controller(str(name), parameters)


def _pair(text: str) -> tuple[str, float | list[float]]:
    """Name and value of `NAME=VALUE`, where the value is a number or several with commas between them."""
    name, _, value = text.partition("=")
    try:
        numbers = [float(part) for part in value.split(",")]
    except ValueError:
        remedy = "give NAME=VALUE, such as junction_deviation=0.02"
        raise click.UsageError(f"--controller-option {text} is no number by name: {remedy}") from None
    return name.strip(), numbers[0] if len(numbers) == 1 else numbers
