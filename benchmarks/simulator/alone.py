"""LinuxCNC's HAL, of which a computer has one, in processes and memory of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# LinuxCNC's modules are those of the system's Python.
PYTHON = "/usr/bin/python3"
# A user without rights: HAL refuses to run as root without one.
_NOBODY = "65534"
_ALONE = ["unshare", "--pid", "--fork", "--kill-child", "--mount-proc", "--ipc", "--net"]


def missing() -> str | None:
    """Why HAL cannot run here, in a sentence; None where it can."""
    if shutil.which("halrun") is None:
        return "LinuxCNC is not installed: apt-get install linuxcnc-uspace"
    found = subprocess.run([PYTHON, "-c", "import hal; hal.stream"], env=_clean(), capture_output=True)
    if found.returncode:
        return f"{PYTHON} has no module hal with streams: apt-get install linuxcnc-uspace 2.9 or newer"
    if not alone() and subprocess.run(["pgrep", "-x", "rtapi_app"], capture_output=True).returncode == 0:
        return "another program uses HAL on this computer, where HAL runs once: end it"
    return None


def alone() -> list[str]:
    """What gives a command processes, shared memory and ports of its own, which end with it; nothing where
    the system does not allow that."""
    allowed = shutil.which("unshare") and subprocess.run([*_ALONE, "true"], capture_output=True)
    return _ALONE if allowed and allowed.returncode == 0 else []


@contextmanager
def folder_and_environment() -> Iterator[tuple[Path, dict[str, str]]]:
    """A folder that HAL's user may write to, and the variables of HAL with its socket there."""
    # Not in /tmp, where LinuxCNC has a file that says that it runs.
    with tempfile.TemporaryDirectory(prefix="hal", dir="/var/tmp") as place:
        os.chmod(place, 0o777)
        user = {"RTAPI_UID": _NOBODY} if os.getuid() == 0 else {}
        own = {"RTAPI_FIFO_PATH": f"{place}/socket", "HOME": place}
        yield Path(place), _clean() | user | own


def _clean() -> dict[str, str]:
    """The environment without that of this Python."""
    return {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
