"""What axis words mean on a machine."""

from __future__ import annotations

from enum import IntEnum


class Meaning(IntEnum):
    """Of axis words."""

    # Every word is the position of the joint of its letter.
    JOINTS = 0
    # X, Y, Z are the tip on the part, rotary words the angles of the rotary joints (G43.4).
    TIP = 1
    # X, Y, Z are the tip on the part, I, J, K the tool's direction (G43.5).
    VECTOR = 2
