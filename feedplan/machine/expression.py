"""Records a kinematics' formula as a list of operations: it is called once with objects that record their
use.

The native module evaluates the list on numbers, on Taylor series and on intervals. A formula that needs the
value of a coordinate, by a comparison or a function of another package, cannot be recorded and is refused.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from feedplan.arguments import shown
from feedplan.arrays import Floats
from feedplan.errors import MachineError


class Op(IntEnum):
    """The codes of operations, as the native module knows them."""

    CONSTANT = 0
    NEGATIVE = 1
    SUM = 2
    DIFFERENCE = 3
    PRODUCT = 4
    QUOTIENT = 5
    SHIFT = 6  # x plus a constant
    SCALE = 7  # x times a constant
    SQUARE = 8
    ROOT = 9
    SINE = 10  # the next operation is the cosine of the same angle
    COSINE = 11
    ANGLE = 12
    RADIANS = 13
    DEGREES = 14


_AFFINE = [Op.CONSTANT, Op.NEGATIVE, Op.SUM, Op.DIFFERENCE, Op.SHIFT, Op.SCALE, Op.RADIANS, Op.DEGREES]


@dataclass(frozen=True, eq=False)
class Expression:
    """Joints as operations on tip coordinates.

    Results are numbered: first the `inputs` coordinates, then one for each row of `operations` (n, 3), which
    is a code and the numbers of its operands; `constants` (n,) are the constants of operations that have one.
    `outputs` (joints,) are the numbers of the results that are joint positions; `turning` (joints,): the
    joint is known up to whole turns.
    """

    inputs: int
    operations: NDArray[np.int32]
    constants: Floats
    outputs: NDArray[np.int32]
    turning: tuple[bool, ...]

    @property
    def affine(self) -> bool:
        """Whether every joint is a weighted sum of tip coordinates and a constant."""
        return bool(np.isin(self.operations[:, 0], _AFFINE).all())


def record(
    name: str,
    formula: Callable[[tuple[Traced, ...]], Iterable[Any]],
    inputs: int,
    joint_names: tuple[str, ...],
    turning: Iterable[bool],
) -> Expression:
    """Records the formula of the kinematics `name` from `inputs` tip coordinates to the joints.

    Raises MachineError, which says why the formula cannot be recorded.
    """
    tape = _Tape(name, inputs)
    given = formula(tuple(Traced(tape, i) for i in range(inputs)))
    if not isinstance(given, Iterable):
        tape.refuse(f"gives {shown(given)} in place of the joint positions")
    joints = tuple(given)
    if len(joints) != len(joint_names):
        raise MachineError(
            f"the kinematics {name} gives {len(joints)} joint positions: give one for each of "
            f"{', '.join(joint_names)}"
        )
    outputs = [tape.number(joint) for joint in joints]
    return Expression(
        inputs,
        np.array(tape.rows, dtype=np.int32).reshape(-1, 3),
        np.array(tape.constants, dtype=np.float64),
        np.array(outputs, dtype=np.int32),
        tuple(map(bool, turning)),
    )


class _Tape:
    """The operations recorded so far; the same operation on the same operands is recorded once."""

    def __init__(self, name: str, inputs: int) -> None:
        self.name, self.inputs = name, inputs
        self.rows: list[tuple[int, int, int]] = []
        self.constants: list[float] = []
        self._known: dict[tuple[int, int, int, float, float], int] = {}

    def add(self, op: Op, first: int = 0, second: int = 0, constant: float = 0.0) -> Traced:
        # The sign of 0 matters in a quotient.
        key = (op, first, second, constant, math.copysign(1.0, constant))
        if key not in self._known:
            self._known[key] = self.inputs + len(self.rows)
            self.rows.append((op, first, second))
            self.constants.append(constant)
        return Traced(self, self._known[key])

    def number(self, joint: Any) -> int:
        """The number of the result that is a joint position; a constant is recorded first."""
        if isinstance(joint, Traced):
            return joint.number
        if not (_is_scalar(joint) and math.isfinite(joint)):
            self.refuse(f"gives {joint!r} as a joint position")
        return self.add(Op.CONSTANT, constant=float(joint)).number

    def refuse(self, what: str) -> NoReturn:
        raise MachineError(
            f"the kinematics {self.name} {what}: write joints() as one formula for all places, with "
            "+ - * / **, abs and the functions of feedplan.machine.numbers"
        )


def _refused(what: str) -> Callable[..., Any]:
    """A method that raises MachineError when a formula uses it."""

    def method(self: Traced, *_: Any, **__: Any) -> NoReturn:
        self.tape.refuse(what)

    return method


class Traced:
    """The result of an operation on a tape; `number` is its index in the list."""

    __slots__ = ("number", "tape")

    def __init__(self, tape: _Tape, number: int) -> None:
        self.tape, self.number = tape, number

    def _with(self, op: Op, other: Traced | None = None, constant: float = 0.0) -> Traced:
        return self.tape.add(op, self.number, 0 if other is None else other.number, constant)

    def __neg__(self) -> Traced:
        return self._with(Op.NEGATIVE)

    def __pos__(self) -> Traced:
        return self

    def __abs__(self) -> Traced:
        return self.square().sqrt()

    def __add__(self, other: Any) -> Traced:
        if isinstance(other, Traced):
            return self._with(Op.SUM, other)
        return self._with(Op.SHIFT, constant=float(other)) if _is_scalar(other) else NotImplemented

    __radd__ = __add__

    def __sub__(self, other: Any) -> Traced:
        if isinstance(other, Traced):
            return self._with(Op.DIFFERENCE, other)
        return self._with(Op.SHIFT, constant=-float(other)) if _is_scalar(other) else NotImplemented

    def __rsub__(self, other: Any) -> Traced:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Traced:
        if isinstance(other, Traced):
            return self.square() if other.number == self.number else self._with(Op.PRODUCT, other)
        return self._with(Op.SCALE, constant=float(other)) if _is_scalar(other) else NotImplemented

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Traced:
        return self._with(Op.QUOTIENT, self._of(other)) if _is_number(other) else NotImplemented

    def __rtruediv__(self, other: Any) -> Traced:
        return self._of(other)._with(Op.QUOTIENT, self) if _is_number(other) else NotImplemented

    def __pow__(self, exponent: Any) -> Traced:
        if isinstance(exponent, Traced):
            exponent.__rpow__(self)
        if not (_is_scalar(exponent) and exponent == int(exponent) and exponent >= 1):
            self.tape.refuse(f"takes the power {exponent!r}; only whole powers from 1 on are known")
        if exponent == 1:
            return self
        half = (self ** (int(exponent) // 2)).square()
        return half * self if exponent % 2 else half

    def __rpow__(self, base: Any) -> NoReturn:
        self.tape.refuse("takes a power with a coordinate as exponent; only whole powers from 1 on are known")

    def _of(self, value: Any) -> Traced:
        return value if isinstance(value, Traced) else self.tape.add(Op.CONSTANT, constant=float(value))

    def square(self) -> Traced:
        """x²."""
        return self._with(Op.SQUARE)

    def sqrt(self) -> Traced:
        """√x."""
        return self._with(Op.ROOT)

    def sin_cos(self) -> tuple[Traced, Traced]:
        """Sine and cosine of an angle in radians."""
        sine = self._with(Op.SINE)
        if sine.number == self.tape.inputs + len(self.tape.rows) - 1:
            self._with(Op.COSINE)
        return sine, Traced(self.tape, sine.number + 1)

    def atan2(self, y: Any, x: Any) -> Traced:
        """The angle of the vector (x, y) in radians."""
        return self._of(y)._with(Op.ANGLE, self._of(x))

    def radians(self) -> Traced:
        """Degrees as radians."""
        return self._with(Op.RADIANS)

    def degrees(self) -> Traced:
        """Radians as degrees."""
        return self._with(Op.DEGREES)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **_: Any) -> Any:
        """Arithmetic with a NumPy number on the left; raises MachineError for other functions."""
        known = _ARITHMETIC.get(ufunc.__name__)
        if known is None or method != "__call__" or not all(_is_number(x) for x in inputs):
            self.tape.refuse(f"uses numpy's {ufunc.__name__}")
        return known(*(x if isinstance(x, Traced) else float(x) for x in inputs))

    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = _refused("compares a coordinate")
    __hash__ = None  # type: ignore[assignment]
    __bool__ = _refused("branches on a coordinate")
    __float__ = __int__ = __index__ = __complex__ = _refused("asks for the value of a coordinate")
    __mod__ = __rmod__ = __floordiv__ = __rfloordiv__ = _refused("divides a coordinate with a remainder")
    __round__ = __floor__ = __ceil__ = __trunc__ = _refused("rounds a coordinate")


_ARITHMETIC: dict[str, Callable[..., Any]] = {
    "add": operator.add,
    "subtract": operator.sub,
    "multiply": operator.mul,
    "divide": operator.truediv,
}


def _is_scalar(value: Any) -> bool:
    return isinstance(value, (float, int, np.floating, np.integer))


def _is_number(value: Any) -> bool:
    return isinstance(value, Traced) or _is_scalar(value)
