"""Damaged files: samples of every kind of file that is read, and mutations of them."""

from __future__ import annotations

import io
import random
import re
import zipfile
from collections.abc import Callable

_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_NUMBERS = (
    *(b"0", b"-1", b"1e-320", b"1e308", b"1e999", b"-1e30", b"nan", b"inf", b"0x10", b"1_0", b"007"),
    *(b"true", b'"7"', b"[]", b"{}", b"1e", b".", b"9" * 19, b"9" * 400, b"1" * 5000, b"0." + b"3" * 3000),
)
_PIECES = (
    *(b"[" * 200, b"[" * 100_000, b'{"a":' * 2000, b"(" * 500, b"a." * 3000, b"a = " * 50, b"[[axes]]\n"),
    *(
        b"\x00",
        b"\xff\xfe",
        b"\xef\xbb\xbf",
        b"\r",
        b"\n",
        b"\n\n",
        b"\t",
        b'"',
        b"'",
        b"#",
        b"%",
        b"\\u0000",
    ),
    *(
        b"\xe2\x80\xae",
        b"\xed\xa0\x80",
        b"=" * 40,
        b",",
        b":",
        b"-",
        b"e",
        b"A" * 70_000,
        b"999\n",
        b"0\nEOF\n",
    ),
)


def mutated(content: bytes, seed: int) -> bytes:
    """The content with one to four changes."""
    draw = random.Random(seed)
    for _ in range(draw.randint(1, 4)):
        content = draw.choice(_MUTATIONS)(content, draw)
    return content


def mutated_archive(content: bytes, seed: int) -> bytes:
    """A damaged archive, or an archive with damaged members."""
    if seed % 2:
        return mutated(content, seed)
    draw = random.Random(seed)
    stream = io.BytesIO()
    method = draw.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(stream, "w", method) as new:
        names = old.namelist()
        damaged = draw.choice(names)
        for name in names:
            member = old.read(name)
            if name == damaged and draw.random() < 0.7:
                # The header has the shape and the type.
                member = mutated(member[:128], seed) + member[128:]
            elif name == damaged:
                member = mutated(member, seed)
            new.writestr(name, member)
    return stream.getvalue()


def _flip(content: bytes, draw: random.Random) -> bytes:
    damaged = bytearray(content)
    for _ in range(draw.randint(1, 8) if damaged else 0):
        damaged[draw.randrange(len(damaged))] ^= 1 << draw.randrange(8)
    return bytes(damaged)


def _truncate(content: bytes, draw: random.Random) -> bytes:
    return content[: draw.randint(0, len(content))]


def _slice(content: bytes, draw: random.Random) -> tuple[int, int]:
    first = draw.randint(0, len(content))
    return first, min(len(content), first + draw.randint(0, 60))


def _repeat(content: bytes, draw: random.Random) -> bytes:
    first, last = _slice(content, draw)
    return content[:last] + content[first:last] * draw.choice((1, 2, 50)) + content[last:]


def _leave_out(content: bytes, draw: random.Random) -> bytes:
    first, last = _slice(content, draw)
    return content[:first] + content[last:]


def _insert(content: bytes, draw: random.Random) -> bytes:
    place = draw.randint(0, len(content))
    return content[:place] + draw.choice(_PIECES) + content[place:]


def _renumber(content: bytes, draw: random.Random) -> bytes:
    found = list(_NUMBER.finditer(content))
    if not found:
        return content
    place = draw.choice(found)
    return content[: place.start()] + draw.choice(_NUMBERS) + content[place.end() :]


def _repeat_line(content: bytes, draw: random.Random) -> bytes:
    lines = content.splitlines(keepends=True)
    if not lines:
        return content
    line = draw.choice(lines)
    lines.insert(draw.randint(0, len(lines)), line)
    return b"".join(lines)


_MUTATIONS: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    *(_flip, _truncate, _repeat, _leave_out, _insert, _renumber, _renumber, _repeat_line),
)

PROGRAM = b"""%
(a part) G21 G90 G17 G64 P0.02
F1200 S1000 M3
#1=[2*3+SIN[30]] #<depth>=-1.5
G0 X0 Y0 Z5
G1 Z#<depth>
G1 X10 Y5
G2 X20 Y15 I0 J10
G3 X18 Y17 R2
G5.1 X25 Y20 I2 J3
G4 P0.1
G81 X5 Y5 Z-2 R1 F300
G80 G91 G1 X-1
G90 G10 L2 P1 X1
G28 Z0
/G1 X3
M30
"""

MACHINE = b"""name = "mine"
period = 0.001
chord_tolerance = 0.01
home = [0.0, 0.0, 50.0]
kinematics = { type = "cartesian" }
[offsets]
G54 = [100.0, 50.0, 0.0]
[[axes]]
name = "X"
max_velocity = 200.0
max_acceleration = 2000.0
max_jerk = 40000.0
travel = [-100.0, 600.0]
[[axes]]
name = "Y"
max_velocity = 200.0
max_acceleration = 2000.0
max_velocity_jump = 0.5
[[axes]]
name = "Z"
max_velocity = 100.0
max_acceleration = 1000.0
"""

# Machines in files of controllers, by the name of the file.
OF_CONTROLLERS = {
    "mill.ini": b"""[EMC]
MACHINE = mill
[EMCMOT]
SERVO_PERIOD = 1000000
[KINS]
KINEMATICS = trivkins coordinates=XYYZ \\
  kinstype=BOTH
[TRAJ]
COORDINATES = X Y Z
LINEAR_UNITS = inch
MAX_LINEAR_VELOCITY = 4
MAX_LINEAR_JERK = 400
#INCLUDE more.inc
[AXIS_X]
MIN_LIMIT = -10 # to the left
MAX_LIMIT = 10
[JOINT_0]
MAX_VELOCITY = 5
MAX_ACCELERATION = 20
[AXIS_Y]
OFFSET_AV_RATIO = 0.2
MAX_ACCELERATION = 20
[AXIS_Z]
MAX_ACCELERATION = 20
""",
    "grbl.txt": b"""Grbl 1.1h ['$' for help]
$11=0.010
$20=1
$22=9
$23=2
$110=6000.000 (x max rate, mm/min)
$111=6000.000
$112=600.000
$120=250.000
$121=200
$122=50.0
$130=300.000
$376=1
$800=3000
ok
""",
    "printer.cfg": b"""[include more/*.cfg]
[stepper_x]
position_min: -5 # behind
position_max: 235
[printer]
kinematics: corexy
max_velocity = 300
max_accel: 3000 ; fast
max_z_velocity: 15
[gcode_macro PARK]
gcode:
    G1 X0
""",
    "joint_limits.yaml": b"""# of a robot
joint_limits:
  shoulder:
    has_velocity_limits: true
    max_velocity: !degrees 180.0
    has_acceleration_limits: true
    max_acceleration: 5.0
  'wrist':
    has_velocity_limits: true
    max_velocity: 3.15 # [rad/s]
    has_acceleration_limits: true
    max_acceleration: 8
    has_position_limits: true
    min_position: -1.5
    max_position: 1.5
""",
}

PATH_FILE = b"""{"unit": "mm", "axes": ["X", "Y", "Z"], "feed": 80.0, "rapid": true, "curves": [
{"degree": 3, "control_points": [[0, 0, 0], [5, 2, 0], [8, 8, 1], [12, 8, 0], [20, 0, 0]], "feed": 60.0},
{"degree": 2, "control_points": [[20, 0, 0], [25, 0, 0], [25, 5, 0]], "weights": [1, 0.7071, 1]},
{"degree": 1, "control_points": [[30, 5, 0], [30, 9, 0]], "knots": [0, 0, 1, 1]}]}
"""

_ENTITIES = (
    *("0 SECTION 2 HEADER 9 $ACADVER 1 AC1009 0 ENDSEC", "0 SECTION 2 ENTITIES"),
    *("0 LINE 8 0 10 0.0 20 0.0 11 10.0 21 0.0", "0 ARC 8 0 10 10.0 20 5.0 40 5.0 50 270.0 51 90.0"),
    *("0 POLYLINE 8 0 66 1 70 0", "0 VERTEX 8 0 10 10.0 20 10.0 42 0.5", "0 VERTEX 8 0 10 0.0 20 10.0"),
    *("0 SEQEND 8 0", "0 CIRCLE 8 0 10 30.0 20 5.0 40 3.0", "0 ENDSEC", "0 EOF"),
)
DRAWING = "".join(f"{word}\n" for row in _ENTITIES for word in row.split()).encode()
