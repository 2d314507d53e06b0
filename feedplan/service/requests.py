"""Checks a request to plan a program, as JSON or as a form, and makes the fingerprint of equal requests."""

from __future__ import annotations

import hashlib
import json
import math
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

from feedplan import __version__
from feedplan.arguments import shown
from feedplan.errors import MachineError
from feedplan.geometry.corners import FollowedPath
from feedplan.machine.axis import Axis
from feedplan.machine.controller import Controller
from feedplan.machine.machine import Machine, bundled_machines
from feedplan.planners import MethodName, given_options, methods, options_of
from feedplan.planning import OF_ALL_METHODS
from feedplan.program.machine_for import AUTO
from feedplan.service.limits import Limits
from feedplan.service.refusals import INPUT, LIMIT, MACHINE, Refusal, over
from feedplan.setpoints import Interpolator

# The greatest length of a program's name. Messages and reports show names; files are not named after them.
LONGEST_NAME = 120
# Options that are keywords of `read_program`; the other options are keywords of `plan`.
READING = ("block_delete", "whole_step")

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
# Values of options that the methods check themselves.
Value = (
    bool
    | int
    | Annotated[float, Field(allow_inf_nan=False)]
    | Annotated[str, Field(max_length=40)]
    | list[float]
)
Model = TypeVar("Model", bound=BaseModel)
_STRICT = ConfigDict(extra="forbid", strict=True)


class CommonOptions(BaseModel):
    """Options of reading and planning; each method takes some more."""

    model_config = _STRICT

    tolerance: Positive | None = Field(default=None, description="Distance from the programmed path [mm]")
    feed: Positive | None = Field(default=None, description="Feed in place of the programmed one [mm/s]")
    feed_override: Positive | None = Field(default=None, description="Factor on the feed")
    period: Positive | None = Field(default=None, description="Servo period in place of the machine's [s]")
    start_speed: NotNegative | None = Field(default=None, description="[mm/s]")
    end_speed: NotNegative | None = Field(default=None, description="[mm/s]")
    interpolator: Interpolator | None = None
    max_setpoints: int | None = Field(default=None, ge=1, description="A plan of more setpoints is refused")
    path: FollowedPath | None = None
    path_rounds: int | None = Field(default=None, ge=1, le=3, description="Fits of the fastest path")
    controller: str | dict[str, Value] | None = Field(
        default=None, description="The controller of today: its name, or a table as in a machine file"
    )
    block_delete: bool | None = Field(default=None, description="Leave out blocks that start with /")
    whole_step: Positive | None = Field(default=None, description="Unit of lengths without a decimal point")


def _of_methods() -> dict[str, Any]:
    """A field for each option that only some methods take."""
    takers: dict[str, list[str]] = {}
    for method in methods():
        for name in options_of(method):
            takers.setdefault(name, []).append(method)
    return {
        name: (Value | None, Field(default=None, description=", ".join(some)))
        for name, some in takers.items()
    }


if TYPE_CHECKING:
    Options = CommonOptions
else:
    Options = create_model("Options", __base__=CommonOptions, __doc__=CommonOptions.__doc__, **_of_methods())


class PlanRequest(BaseModel):
    """Machine, method and options for planning a program."""

    model_config = _STRICT

    name: str = Field(
        "", max_length=LONGEST_NAME, description="Name of the program; its ending decides the language"
    )
    machine: str = Field(
        default="mill", description="A bundled machine, auto, or the text of a machine file (TOML)"
    )
    method: MethodName = "bang-bang"
    options: Options = Field(default_factory=Options)
    tool_table: str | None = Field(
        default=None, max_length=1 << 20, description="LinuxCNC's tool table (.tbl)"
    )


class JobRequest(PlanRequest):
    """A program, with machine, method and options."""

    program: str | dict[str, Any] = Field(description="G-code, a drawing (DXF), or a path file as an object")


class LimitChange(BaseModel):
    """Limits of an axis that replace those in a machine file."""

    model_config = _STRICT

    max_velocity: float | list[float] | None = Field(
        default=None, description="One number, or the least and the greatest"
    )
    max_acceleration: float | list[float] | None = None
    max_jerk: float | None = Field(default=None, description="null: no limit")

    def on(self, axis: Axis) -> Axis:
        """The axis with these limits. Raises MachineError."""
        given = {name: getattr(self, name) for name in self.model_fields_set}
        if given.get("max_jerk", 0.0) is None:
            given["max_jerk"] = math.inf
        return replace(axis, **given)


class MachineRequest(BaseModel):
    """A machine, and limits that replace some of its own."""

    model_config = _STRICT

    machine: str = Field(description="A bundled machine, or the text of a machine file (TOML)")
    limits: dict[str, LimitChange] = Field(default_factory=dict, description="By the name of the axis")


def machine_of(request: MachineRequest) -> Machine:
    """The machine with the changed limits. Raises Refusal and MachineError."""
    known = _machine(request.machine)
    names = [axis.name for axis in known.axes]
    for name in request.limits:
        if name not in names:
            raise MachineError(
                f"the machine {known.name} has no axis {name[:32]}: give some of {', '.join(names)}"
            )
    axes = [
        request.limits[axis.name].on(axis) if axis.name in request.limits else axis for axis in known.axes
    ]
    return replace(known, axes=tuple(axes))


@dataclass(frozen=True)
class Order:
    """A checked request: `name` of the program, whole text of the `machine` (or `auto`) and its name,
    `method`, the given `options`, text of the `tool_table`."""

    name: str
    machine: str
    machine_name: str
    method: MethodName
    options: dict[str, Any]
    tool_table: str | None

    def fingerprint(self, program_sha256: str) -> str:
        """A hash that is equal for requests with equal plans by the same version of feedplan."""
        parts = [
            __version__,
            program_sha256,
            self.name,
            self.machine,
            self.method,
            json.dumps(self.options, sort_keys=True),
            self.tool_table,
        ]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def order_of(request: PlanRequest, limits: Limits) -> Order:
    """The request, checked without reading its program. Raises Refusal and FeedplanError."""
    options = request.options.model_dump(exclude_none=True)
    asked = options.get("max_setpoints", 1)
    if asked > limits.max_setpoints:
        said = f"max_setpoints is {asked}, the service has {limits.max_setpoints}: ask for fewer"
        raise over(limits, LIMIT, said)
    own = {name: value for name, value in options.items() if name not in (*OF_ALL_METHODS, *READING)}
    given_options(request.method, own, OF_ALL_METHODS)
    if "controller" in options:
        Controller.of(options["controller"])
    text = machine_name = AUTO
    if request.machine != AUTO:
        machine = _machine(request.machine, AUTO)
        text, machine_name = machine.to_toml(), machine.name
    return Order(_title(request.name), text, machine_name, request.method, options, request.tool_table)


def _machine(given: str, *others: str) -> Machine:
    """The bundled machine of that name, or the machine of a text. `others` are further names that the message
    lists as valid. The service reads no file that a client names."""
    if given in bundled_machines():
        return Machine.load(given)
    if "=" in given:
        return Machine.from_toml(given, "of the request")
    known = ", ".join((*others, *bundled_machines()))
    raise Refusal(
        MACHINE, f"there is no machine of this name: use one of {known}, or the text of a machine file"
    )


def _title(given: str) -> str:
    """The printable characters of the last part of a name; may be empty."""
    name = PurePosixPath(given.replace("\\", "/")).name
    return "".join(letter for letter in name if letter.isprintable()).strip()


def require_once(text: bytes | str, *within: str) -> None:
    """Raises Refusal if a name occurs twice in a JSON object: readers would use the last value."""

    def once(pairs: list[tuple[str, Any]]) -> None:
        known: set[str] = set()
        for name, _ in pairs:
            if name in known:
                place = f"{'.'.join(within) or 'the request'}: {shown(name)}"
                raise Refusal(INPUT, f"{place} comes twice in one object: give it once")
            known.add(name)

    # Texts that are not JSON are refused later, by their reader.
    with suppress(ValueError, RecursionError):
        json.loads(text, object_pairs_hook=once)


def parsed(model: type[Model], text: bytes | str, *within: str) -> Model:
    """A model from JSON, which is the member `within` of the request. Raises Refusal for the first member
    that is wrong."""
    require_once(text, *within)
    try:
        return model.model_validate_json(text)
    except ValidationError as error:
        wrong = error.errors(include_url=False, include_input=False)[0]
        raise Refusal(INPUT, sentence_of({**wrong, "loc": (*within, *wrong["loc"])})) from None


def sentence_of(error: Any) -> str:
    """An error of pydantic as one sentence."""
    # A program is a text or an object, so pydantic adds the type that it tried to the place of the error; it
    # is left out.
    parts = [str(part)[:60] for part in error["loc"] if part != "str" and "[" not in str(part)]
    member = ".".join(parts) or "the request"
    said = str(error["msg"])[:220]
    # The first letter is made lower case, except in names such as JSON.
    said = said if said[:2].isupper() else f"{said[:1].lower()}{said[1:]}"
    return f"{member}: {said}: correct it as the documentation at /docs tells"
