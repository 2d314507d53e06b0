"""A machine as text: however it was made, its text gives the same machine again."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from feedplan import Axis, Machine, MachineError
from feedplan.machine.axis import AXIS_LETTERS, FARTHEST
from feedplan.machine.kinematics import Kinematics, _registered, register
from feedplan.machine.machine import CHORD_TOLERANCES, PERIODS, bundled_machines

FINITE = st.floats(-FARTHEST, FARTHEST)
NAMES = st.text(min_size=1)
LEAVES = st.one_of(
    NAMES, st.just(""), st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False)
)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NAMES, inner, max_size=3),
    max_leaves=8,
)


@st.composite
def axes(draw: st.DrawFn) -> tuple[Axis, ...]:
    letters = draw(st.lists(st.sampled_from(AXIS_LETTERS), min_size=1, max_size=6, unique=True))
    return tuple(draw(axis(letter)) for letter in letters)


@st.composite
def axis(draw: st.DrawFn, name: str) -> Axis:
    ends = FINITE | st.sampled_from([-math.inf, math.inf])
    travel = sorted(draw(st.lists(ends, min_size=2, max_size=2, unique=True)))
    velocity = draw(st.floats(1.0, 1e6))
    acceleration = velocity / draw(st.floats(2e-4, 50.0))
    return Axis(
        name,
        velocity,
        acceleration,
        acceleration / draw(st.floats(0.02, 5.0)) if draw(st.booleans()) else math.inf,
        (travel[0], travel[1]),
        draw(st.floats(0.0, 1.0)),
        draw(st.sampled_from(["", "linear", "rotary"])),
    )


@st.composite
def machines(draw: st.DrawFn) -> Machine:
    own = draw(axes())
    row = st.lists(FINITE, min_size=len(own), max_size=len(own)).map(tuple)
    return Machine(
        name=draw(NAMES),
        axes=own,
        period=draw(st.floats(1e-5, PERIODS[1])),
        chord_tolerance=draw(st.floats(1e3, CHORD_TOLERANCES[1]) | st.just(math.inf)),
        home=draw(row | st.just(())),
        offsets=draw(st.dictionaries(NAMES, row, max_size=3)),  # type: ignore[arg-type]
    )


@given(machines())
def test_any_machine_comes_back_from_its_text(machine: Machine) -> None:
    again = Machine.from_toml(machine.to_toml(), "machine.toml")
    assert again == machine
    assert again.parameters == machine.parameters


class Anything(Kinematics):
    """A kinematics whose joints are the tip, whatever its parameters are."""

    tip_names = joint_names = ("X", "Y")

    def joints(self, tip: Any) -> Any:
        return tip


@given(st.dictionaries(NAMES.filter(lambda key: key != "type"), VALUES, max_size=4))
def test_any_parameters_of_a_kinematics_come_back(parameters: dict[str, Any]) -> None:
    def factory(_: object, given: Any) -> Kinematics:
        given._asked = list(parameters)
        return Anything()

    register("anything", factory)
    try:
        own = (Axis("X", 1, 1), Axis("Y", 1, 1))
        machine = Machine("m", own, kinematics="anything", parameters=parameters, home=(1.0, 2.0))
        again = Machine.from_toml(machine.to_toml(), "m")
        assert (again, again.parameters) == (machine, parameters)
    finally:
        del _registered["anything"]


@pytest.mark.parametrize("name", bundled_machines())
def test_every_bundled_machine_comes_back_with_its_kinematics(name: str) -> None:
    machine = Machine.load(name)
    again = Machine.from_toml(machine.to_toml(), "m")
    assert (again, again.parameters, again.inverse) == (machine, machine.parameters, machine.inverse)


def test_numbers_of_numpy_are_written_as_numbers() -> None:
    parameters = {"tool_length": np.float64(120.5), "pivot_a": np.array([0, 0, 50]), "reversed": ("C",)}
    load = Machine.load("trunnion-ac")
    machine = Machine("m", load.axes, kinematics="trunnion-ac", parameters=parameters)
    assert machine.parameters == {"tool_length": 120.5, "pivot_a": [0, 0, 50], "reversed": ["C"]}
    assert Machine.from_toml(machine.to_toml(), "m").inverse == machine.inverse


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"name": 7}, "name is 7: give a text"),
        ({"name": ""}, "name is '': give a text"),
        ({"name": "\ud800"}, "name is .*: give a text"),
        (
            {"parameters": {"scale": print}},
            "kinematics scale is <built-in.*: give text, true or",
        ),
        (
            {"parameters": {"scale": {"X": math.nan}}},
            "kinematics scale X is nan: give text, true",
        ),
        ({"parameters": {"type": "polar"}}, "kinematics is .*: give a table of its keys, other than type"),
        ({"offsets": (("G54", (0.0,)), ("G54", (1.0,)))}, "offsets is .*: give each name once"),
        ({"offsets": {54: (0.0,)}}, "offsets: a name is 54: give a text"),
    ],
)
def test_what_a_file_cannot_hold_is_refused_where_the_machine_is_made(
    change: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(MachineError, match=sentence):
        Machine(**({"name": "m", "axes": (Axis("X", 1, 1),)} | change))
