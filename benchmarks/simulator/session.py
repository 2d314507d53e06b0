"""A session of LinuxCNC's simulator: a machine with X, Y and Z runs programs and streams one after the other.

The machine is ideal: its joints follow their commands at once. `mux2` switches the joints between LinuxCNC's
own motion and the stream, and `sampler` records them in every servo period. Programs without G64 run with
`tolerance` (G64 P).
"""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.simulator.alone import PYTHON, alone, folder_and_environment
from feedplan import Machine
from feedplan.outputs.halstreamer import pins

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

NAMES = ("X", "Y", "Z")
# Longest time for start, stop and changes between runs [s], and of a run, over the expected time.
_BESIDE, _PATIENCE = 60.0, 3.0
# Number of rows of a stream that HAL's memory holds [periods].
_DEPTH = 16000
# Numbers of the persistent parameters: the smallest set that LinuxCNC requires in its file.
_KEPT = (
    *range(5161, 5170),
    *range(5181, 5190),
    *range(5210, 5231),
    *(5220 + 20 * k + i for k in range(1, 10) for i in range(1, 11)),
)

_INI = """[EMC]
VERSION=1.1
MACHINE=simulated
DEBUG=0
[DISPLAY]
DISPLAY={folder}/driver.py
[RS274NGC]
PARAMETER_FILE=kept.var
[EMCMOT]
EMCMOT=motmod
COMM_TIMEOUT=10
SERVO_PERIOD={nanoseconds}
[EMCIO]
EMCIO=io
CYCLE_TIME=0.05
TOOL_TABLE=tools.tbl
[TASK]
TASK=milltask
CYCLE_TIME=0.001
[HAL]
HALFILE=machine.hal
[TRAJ]
COORDINATES=XYZ
LINEAR_UNITS=mm
ANGULAR_UNITS=degree
DEFAULT_LINEAR_VELOCITY={velocity}
MAX_LINEAR_VELOCITY={velocity}
DEFAULT_LINEAR_ACCELERATION={acceleration}
MAX_LINEAR_ACCELERATION={acceleration}
NO_FORCE_HOMING=1
[KINS]
KINEMATICS=trivkins coordinates=XYZ
JOINTS=3
"""
_AXIS = """[AXIS_{name}]
MAX_VELOCITY={velocity}
MAX_ACCELERATION={acceleration}
MIN_LIMIT=-1e6
MAX_LIMIT=1e6
[JOINT_{number}]
TYPE=LINEAR
MAX_VELOCITY={velocity}
MAX_ACCELERATION={acceleration}
MIN_LIMIT=-1e6
MAX_LIMIT=1e6
FERROR=1e9
MIN_FERROR=1e9
HOME=0
HOME_SEQUENCE=0
HOME_SEARCH_VEL=0
HOME_LATCH_VEL=0
"""
_HAL = f"""loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
loadrt mux2 count=3
loadrt not
loadrt streamer depth={_DEPTH} cfg={pins(NAMES)}
loadrt sampler depth={_DEPTH} cfg=fffbbbs
setp streamer.0.enable 0
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf streamer.0 servo-thread
addf mux2.0 servo-thread
addf mux2.1 servo-thread
addf mux2.2 servo-thread
addf not.0 servo-thread
addf sampler.0 servo-thread
net still motion.in-position => not.0.in
net moving not.0.out => sampler.0.pin.3
net done streamer.0.empty => sampler.0.pin.5
net change iocontrol.0.tool-change => iocontrol.0.tool-changed
net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net stop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
""" + "".join(
    f"net own{k} joint.{k}.motor-pos-cmd => mux2.{k}.in0\n"
    f"net stream{k} streamer.0.pin.{k} => mux2.{k}.in1\n"
    f"net joint{k} mux2.{k}.out => joint.{k}.motor-pos-fb sampler.0.pin.{k}\n"
    for k in range(3)
)
_START = """set -e
mount --bind "$1/tmp" /tmp
ip link set lo up 2>/dev/null || true
exec linuxcnc -r "$1/machine.ini"
"""


class SimulatorError(Exception):
    """LinuxCNC could not run the session; the text is its message in one sentence."""


@dataclass(frozen=True)
class Run:
    """A run that takes about `seconds`: the text of a program, or the file of a stream."""

    what: bytes | Path
    seconds: float


@dataclass(frozen=True, eq=False)
class Recorded:
    """The joints in every servo period of a run: `position` (n, 3) [mm], `moving` (n,) while LinuxCNC's own
    planner moves, `playing` (n,) while a row of a stream is played; and the messages of the run."""

    period: float
    position: Array
    moving: Flags
    playing: Flags
    said: tuple[str, ...]

    @property
    def motion(self) -> float:
        """The time in motion of a program, without pauses [s]."""
        return float(self.moving.sum()) * self.period

    @property
    def played(self) -> Array:
        """The positions from the first to the last row of a stream (n, 3)."""
        return self.position[self.playing]


def recorded(machine: Machine, runs: Sequence[Run], tolerance: float) -> list[Recorded]:
    """The recorded joints of each run; each run starts at the origin.

    Raises SimulatorError if LinuxCNC does not start, does not end, or misses periods.
    """
    if machine.axis_names != NAMES:
        raise SimulatorError(f"the machine {machine.name} has other axes than X, Y, Z: take one with these")
    if not alone():
        raise SimulatorError("the simulator needs processes of its own (unshare): run it as root")
    with folder_and_environment() as (folder, environment):
        _write(folder, machine, runs, tolerance)
        (folder / "start.sh").write_text(_START)
        try:
            done = subprocess.run(
                [*alone(), "--mount", "bash", str(folder / "start.sh"), str(folder)],
                env={name: value for name, value in environment.items() if name != "DISPLAY"},
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                timeout=_BESIDE + 2.0 * _PATIENCE * sum(run.seconds for run in runs),
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise SimulatorError(f"LinuxCNC did not end in {error.timeout:g} s") from error
        said = folder / "said.json"
        if not said.exists():
            raise SimulatorError(f"LinuxCNC did not start: {(done.stdout + done.stderr)[-2000:]}")
        told = json.loads(said.read_text())
        if told["failed"] is not None:
            number = len(told["runs"]) + 1
            raise SimulatorError(f"run {number} of {len(runs)} failed: {told['failed']}")
        if told["lost"]:
            raise SimulatorError(f"{told['lost']} periods were not recorded: the computer is too busy")
        rows = np.fromfile(folder / "rows.bin", dtype="<f8").reshape(-1, 7)
    results = []
    for number, messages in enumerate(told["runs"], start=1):
        own = rows[rows[:, 6] == number]
        moving, playing, done = (own[:, 3:6] > 0.0).T
        result = Recorded(machine.period, own[:, :3], moving, playing & ~done, tuple(messages))
        late = (np.diff(np.flatnonzero(result.playing)) > 1).sum()
        if late:
            raise SimulatorError(f"{late} rows of stream {number} were late: the computer is too busy")
        results.append(result)
    return results


def _write(folder: Path, machine: Machine, runs: Sequence[Run], tolerance: float) -> None:
    """The files of a session."""
    along = {"velocity": 2.0 * max(axis.max_velocity for axis in machine.axes)}
    along["acceleration"] = 2.0 * max(axis.max_acceleration for axis in machine.axes)
    text = _INI.format(folder=folder, nanoseconds=round(1e9 * machine.period), **along)
    for number, axis in enumerate(machine.axes):
        text += _AXIS.format(
            number=number, name=axis.name, velocity=axis.max_velocity, acceleration=axis.max_acceleration
        )
    (folder / "machine.ini").write_text(text)
    (folder / "machine.hal").write_text(_HAL)
    (folder / "kept.var").write_text("".join(f"{number}\t0\n" for number in _KEPT))
    (folder / "tools.tbl").write_text("".join(f"T{number} P{number} D0 Z0\n" for number in range(1, 100)))
    (folder / "tmp").mkdir()
    driver = folder / "driver.py"
    driver.write_text(f"#!{PYTHON}\n" + (Path(__file__).parent / "driver.py").read_text())
    driver.chmod(0o755)
    told = []
    for number, run in enumerate(runs, start=1):
        stream = isinstance(run.what, Path)
        file = folder / (f"{number}.halstream" if stream else f"{number}.ngc")
        if isinstance(run.what, Path):
            shutil.copy(run.what, file)
        else:
            file.write_bytes(run.what)
        told.append({"file": str(file), "stream": stream, "seconds": _PATIENCE * run.seconds + 10.0})
    startup = f"G21 G64 P{tolerance:g}"
    (folder / "runs.json").write_text(json.dumps({"startup": startup, "runs": told}))
