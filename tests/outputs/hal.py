"""Runs LinuxCNC's HAL without its real-time kernel: `streamer` plays a file and `sampler` records it."""

from __future__ import annotations

import subprocess
from pathlib import Path

from benchmarks.simulator.alone import PYTHON, alone, folder_and_environment

# Number of rows that HAL's memory holds. A stream is loaded before it is played, so that a busy computer
# cannot interrupt it.
DEPTH = 16000
# The key of sampler's shared memory.
_SAMPLER = 0x48534130
_SECONDS = 60

_RECORD = f"""
import sys, time, hal
component = hal.component("recorder")
component.ready()
stream = hal.stream(component, {_SAMPLER}, sys.argv[1])
rows, wanted = [], int(sys.argv[2])
while len(rows) < wanted:
    if stream.readable:
        rows.append(stream.read())
    else:
        time.sleep(0.01)
with open(sys.argv[3], "w") as file:
    file.writelines(" ".join(map(repr, row)) + "\\n" for row in rows)
"""


def played(file: Path, pins: str, count: int, folder: Path) -> list[str]:
    """The values in `count` periods of a stream, on pins of the types `pins`; one text of numbers per period.

    Fails if `halstreamer` complains about a line.
    """
    record, rows = folder / "record.py", folder / "rows.txt"
    record.write_text(_RECORD)
    nets = (f"net pin{k} streamer.0.pin.{k} => sampler.0.pin.{k}" for k in range(len(pins)))
    script = [
        "loadrt threads name1=servo period1=1000000",
        f"loadrt streamer depth={DEPTH} cfg={pins}",
        f"loadrt sampler depth={DEPTH} cfg={pins}",
        *nets,
        "addf streamer.0 servo",
        "addf sampler.0 servo",
        f"loadusr -w halstreamer {file}",
        "start",
        f"loadusr -w {PYTHON} {record} {pins} {count} {rows}",
    ]
    commands = folder / "stream.hal"
    commands.write_text("\n".join(script) + "\n")
    with folder_and_environment() as (_, environment):
        done = subprocess.run(
            [*alone(), "halrun", "-f", str(commands)],
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_SECONDS,
            check=False,
        )
    said = done.stdout + done.stderr
    assert done.returncode == 0, said
    assert "skipping the line" not in said, said
    return rows.read_text().splitlines()
