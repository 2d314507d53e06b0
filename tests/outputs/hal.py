"""LinuxCNC's HAL without its real-time kernel: `streamer` plays a file, `sampler` records what it plays."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PYTHON = "/usr/bin/python3"
# The longest stream that waits in HAL's memory before it is played, so that the test does not depend on how
# busy the computer is.
DEPTH = 16000
# The key of sampler's shared memory.
_SAMPLER = 0x48534130
# A user without rights: HAL refuses to run as root without one.
_NOBODY = "65534"
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


def missing() -> str | None:
    """Why HAL cannot run here, in a sentence; None where it can."""
    if shutil.which("halrun") is None:
        return "LinuxCNC is not installed: apt-get install linuxcnc-uspace"
    found = subprocess.run([PYTHON, "-c", "import hal; hal.stream"], env=_clean(), capture_output=True)
    if found.returncode:
        return f"{PYTHON} has no module hal with streams: apt-get install linuxcnc-uspace 2.9 or newer"
    if not _apart() and subprocess.run(["pgrep", "-x", "rtapi_app"], capture_output=True).returncode == 0:
        return "another program uses HAL on this computer, where HAL runs once: end it"
    return None


def played(file: Path, pins: str, count: int, folder: Path) -> list[str]:
    """What `count` periods of a stream are on the pins of these types, as rows of numbers.

    Fails where `halstreamer` complains about a line."""
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
    with _environment() as environment:
        done = subprocess.run(
            [*_apart(), "halrun", "-f", str(commands)],
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


@contextmanager
def _environment() -> Iterator[dict[str, str]]:
    """With a socket of its own, in a folder that HAL's user may write to."""
    with tempfile.TemporaryDirectory(prefix="hal") as place:
        os.chmod(place, 0o777)
        user = {"RTAPI_UID": _NOBODY} if os.getuid() == 0 else {}
        yield _clean() | user | {"RTAPI_FIFO_PATH": f"{place}/socket"}


def _clean() -> dict[str, str]:
    """The environment without that of this Python."""
    return {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


def _apart() -> list[str]:
    """What gives a command processes and shared memory of its own, which end with it; nothing where the
    system does not allow that."""
    command = ["unshare", "--pid", "--fork", "--kill-child", "--mount-proc", "--ipc"]
    allowed = (
        shutil.which("unshare") and subprocess.run([*command, "true"], capture_output=True).returncode == 0
    )
    return command if allowed else []
