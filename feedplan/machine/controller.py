"""Models of controllers, and their parameters with the names in the controllers' own files.

A machine file names its controller as `controller = "grbl"`, or in a table with parameters:

    [controller]
    type = "grbl"
    junction_deviation = 0.02

Parameters that are left out have the controller's own defaults. Units are mm and seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from feedplan.arguments import is_number, is_text, shown
from feedplan.errors import MachineError
from feedplan.machine.checks import require, written

# The unit of a parameter with three numbers, for X, Y and Z.
BY_AXIS = "mm/s by axis"


def _positive(value: Any) -> bool:
    return is_number(value) and 0.0 < value < float("inf")


@dataclass(frozen=True)
class Parameter:
    """A parameter: the method's `option` that it sets, its `default` (None: no limit), its `unit`.

    The `unit` "blocks" requires a whole number from 2, `BY_AXIS` three positive numbers, "" a number from 0
    to below 1; all other units require a positive number.
    """

    option: str
    default: float | None
    unit: str

    def checked(self, what: str, value: Any) -> Any:
        """The value in the form of a machine file; raises MachineError for a value that is not allowed."""
        value = written(value, what)
        if self.unit == "blocks":
            good = is_number(value) and value >= 2 and value % 1 == 0
            require(good, what, value, "a whole number from 2")
            return int(value)
        elif self.unit == BY_AXIS:
            good = isinstance(value, (list, tuple)) and len(value) == 3 and all(map(_positive, value))
            require(good, what, value, "three positive numbers [mm/s], for X, Y and Z")
        elif self.unit == "":
            require(is_number(value) and 0.0 <= value < 1.0, what, value, "a number from 0 to less than 1")
        else:
            require(_positive(value), what, value, f"a positive number [{self.unit}]")
        return value


@dataclass(frozen=True)
class Model:
    """The `method` that plans as a controller does, its parameters, and its options that never change."""

    method: str
    parameters: Mapping[str, Parameter]
    options: Mapping[str, Any] = field(default_factory=dict)


def _grbl(blocks: str, held: int) -> Model:
    parameters = {
        "junction_deviation": Parameter("deviation", 0.01, "mm"),
        "arc_tolerance": Parameter("arc_tolerance", 0.002, "mm"),
        blocks: Parameter("blocks", held, "blocks"),
    }
    return Model("junction-deviation", parameters)


# Defaults: LinuxCNC 2.9 ([TRAJ]); grbl 1.1 ($11, $12, 16 blocks of which one is always empty); grblHAL
# ($11, $12, $398); Klipper ([printer], [gcode_arcs]); Marlin 2.1 (Configuration.h, Configuration_adv.h, 16
# blocks of which one is always empty; `jerk` are DEFAULT_XJERK and so on, in place of the deviation).
MODELS: dict[str, Model] = {
    "linuxcnc": Model(
        "linuxcnc",
        {
            "max_linear_velocity": Parameter("max_velocity", None, "mm/s"),
            "max_linear_acceleration": Parameter("max_acceleration", None, "mm/s²"),
            "arc_blend_optimization_depth": Parameter("depth", 50, "blocks"),
        },
    ),
    "grbl": _grbl("block_buffer_size", 15),
    "grblhal": _grbl("planner_blocks", 100),
    "klipper": Model(
        "junction-deviation",
        {
            "max_velocity": Parameter("max_velocity", None, "mm/s"),
            "max_accel": Parameter("max_acceleration", None, "mm/s²"),
            "square_corner_velocity": Parameter("square_corner_velocity", 5.0, "mm/s"),
            "minimum_cruise_ratio": Parameter("cruise_ratio", 0.5, ""),
            "resolution": Parameter("arc_segment", 1.0, "mm"),
        },
        {"short_lines": "half"},
    ),
    "marlin": Model(
        "junction-deviation",
        {
            "acceleration": Parameter("max_acceleration", None, "mm/s²"),
            "junction_deviation": Parameter("deviation", 0.013, "mm"),
            "jerk": Parameter("axis_jumps", None, BY_AXIS),
            "block_buffer_size": Parameter("blocks", 15, "blocks"),
            "max_arc_segment": Parameter("arc_segment", 1.0, "mm"),
        },
        {"short_lines": "arc"},
    ),
}


@dataclass(frozen=True)
class Controller:
    """A controller by `name`, one of `MODELS`, with those of its parameters that differ from the defaults.

    Raises MachineError for an unknown name, for unknown parameters, and for values that are not allowed.
    """

    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        known = is_text(self.name) and self.name in MODELS
        require(known, "the controller", self.name, f"one of {', '.join(MODELS)}")
        require(isinstance(self.parameters, Mapping), f"controller {self.name}", self.parameters, "a table")
        parameters = self.model.parameters
        unknown = sorted(str(key) for key in self.parameters if key not in parameters)
        if unknown:
            raise MachineError(
                f"controller {self.name}: the keys {shown(unknown)} are not known: "
                f"give only {', '.join(parameters)}"
            )
        given = {
            key: parameters[key].checked(f"controller {self.name}: {key}", value)
            for key, value in self.parameters.items()
        }
        object.__setattr__(self, "parameters", given)

    @property
    def model(self) -> Model:
        """The model: the method and the parameters."""
        return MODELS[self.name]

    @property
    def options(self) -> dict[str, Any]:
        """The options of the model's method."""
        given = {
            own.option: self.parameters.get(key, own.default) for key, own in self.model.parameters.items()
        }
        return {**self.model.options, **{name: value for name, value in given.items() if value is not None}}

    @classmethod
    def of(cls, given: Any) -> Controller:
        """A controller from a name, a table with `type` as in a machine file, or itself; raises
        MachineError."""
        if isinstance(given, Controller):
            return given
        table = given if isinstance(given, Mapping) else {"type": given}
        remedy = f"one of {', '.join(MODELS)}, or a table with type and its parameters"
        require(is_text(table.get("type")), "the controller", given, remedy)
        return cls(table["type"], {key: value for key, value in table.items() if key != "type"})
