"""The coordinate mode of a program: the meaning of its axis words on a machine."""

from __future__ import annotations

from enum import IntEnum


class CoordinateMode(IntEnum):
    """The meaning of axis words."""

    JOINTS = 0  # every word is the position of the joint of its letter
    TIP = 1  # X, Y, Z are the tip on the part, rotary words the angles of the rotary joints (G43.4)
    VECTOR = 2  # X, Y, Z are the tip on the part, I, J, K the tool's direction (G43.5)
