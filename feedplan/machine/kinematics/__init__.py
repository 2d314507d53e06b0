"""Kinematics q = K(P): joint positions from the coordinates of the tool tip; one file a machine type.

A module has `build(axes, parameters) -> Kinematics` and is found by its name: the type `trunnion-ac` is the
module `trunnion_ac`. Users add their own with `register`. K is written once, with the functions of
`feedplan.machine.numbers`. It is called once and recorded, and the native module evaluates the record:
positions, exact derivatives along a curve, and their proven bounds.
"""

from __future__ import annotations

import importlib
import pkgutil
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from feedplan.errors import MachineError
from feedplan.lazy import cached_property
from feedplan.machine.axis import ROTARY_LETTERS, Axis
from feedplan.machine.checks import require, require_text
from feedplan.machine.expression import Expression, record
from feedplan.machine.numbers import Number
from feedplan.machine.parameters import Parameters


class Kinematics(ABC):
    """A machine type with its dimensions.

    `tip_names` are the program letters that `joints` takes, in this order; `joint_names` are the machine's
    axis names in its file's order. `rotary`: whether each joint is an angle [deg]; the others are lengths
    [mm]. `turning`: whether each joint is known only up to whole turns, because it comes from `atan2`; along
    a path it is continuous. `always` is true where a program's words always mean the tip, as X, Y, Z on a
    cylindrical machine; false where they are joint positions until G43.4 or the like. `any_unit`: joints need
    not be in mm and degrees.
    """

    tip_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    always: bool = True
    any_unit: bool = False

    @property
    def rotary(self) -> tuple[bool, ...]:
        """Whether each joint is an angle; by default those named A, B or C."""
        return tuple(name in ROTARY_LETTERS for name in self.joint_names)

    @property
    def affine(self) -> bool:
        """Whether the formula of every joint is a weighted sum of tip coordinates and a constant."""
        return self.recorded.affine

    @property
    def turning(self) -> tuple[bool, ...]:
        """Whether each joint is known only up to whole turns; by default none."""
        return (False,) * len(self.joint_names)

    @abstractmethod
    def joints(self, tip: Sequence[Number]) -> tuple[Number, ...]:
        """Joint positions [mm, deg] for a tip [mm, deg]: one formula for all places and types of numbers."""

    @cached_property
    def recorded(self) -> Expression:
        """The formula of `joints`, recorded on first use; raises MachineError where that is not possible."""
        return record(type(self).__name__, self.joints, len(self.tip_names), self.joint_names, self.turning)

    def tip(self, joints: Sequence[Number]) -> tuple[Number, ...]:
        """The tip [mm, deg] for joint positions [mm, deg]: the inverse of `joints`, where there is one."""
        raise MachineError(f"the kinematics {type(self).__name__} has no tip(joints): write that method")

    def singular(self, tip: Sequence[Number]) -> dict[str, Number]:
        """Quantities that vanish where K is singular, by names that complete "the tool is at …"."""
        return {}


Factory = Callable[[tuple[Axis, ...], Parameters], Kinematics]

_registered: dict[str, Factory] = {}


def register(name: str, factory: Factory) -> None:
    """Registers a kinematics under a name for machine files; a later one with the same name replaces it.

    `factory(axes, parameters)` gets the machine's axes in order and its `[kinematics]` keys.
    """
    require_text(name, "the name of a kinematics")
    require(callable(factory), "the factory", factory, "a function of the axes and their parameters")
    if name in _bundled():
        raise MachineError(f"the kinematics '{name}' comes with feedplan: register yours under another name")
    _registered[name] = factory


def types() -> tuple[str, ...]:
    """The names of all kinematics, bundled and registered."""
    return tuple(sorted({*_bundled(), *_registered}))


def create(name: str, axes: tuple[Axis, ...], values: Mapping[str, Any], machine: str) -> Kinematics:
    """The kinematics of a name for a machine's axes; raises MachineError with the remedy."""
    if name in _registered:
        factory = _registered[name]
    elif name in _bundled():
        factory = importlib.import_module(f"{__name__}.{name.replace('-', '_')}").build
    else:
        raise MachineError(
            f"machine {machine}: kinematics is {name!r}: give one of {', '.join(types())}, "
            "or register it by feedplan.machine.kinematics.register"
        )
    parameters = Parameters(values, machine)
    kinematics = factory(axes, parameters)
    what = f"machine {machine}: the result of the factory of {name!r}"
    require(isinstance(kinematics, Kinematics), what, kinematics, "a Kinematics")
    parameters.finish()
    _check_axes(kinematics, axes, parameters)
    return kinematics


def _bundled() -> tuple[str, ...]:
    return tuple(module.name.replace("_", "-") for module in pkgutil.iter_modules(__path__))


def _check_axes(kinematics: Kinematics, axes: tuple[Axis, ...], parameters: Parameters) -> None:
    names = tuple(axis.name for axis in axes)
    if names != kinematics.joint_names:
        raise MachineError(
            f"machine {parameters.machine}: the axes are {', '.join(names)}: this kinematics needs "
            f"{', '.join(kinematics.joint_names)} in that order"
        )
    for axis in () if kinematics.any_unit else axes:
        if axis.unit != axis.usual_unit:
            raise MachineError(
                f"machine {parameters.machine}: axis {axis.name} is in {axis.unit}, but its kinematics needs "
                f"{axis.usual_unit}: convert its limits and leave out unit"
            )
    for axis, rotary in zip(axes, kinematics.rotary, strict=True):
        kind = "rotary" if rotary else "linear"
        if axis.kind != kind:
            raise MachineError(
                f"machine {parameters.machine}: axis {axis.name} is {axis.kind}, but this kinematics needs "
                f'it {kind}: give kind = "{kind}" and limits in {"deg" if rotary else "mm"}'
            )
