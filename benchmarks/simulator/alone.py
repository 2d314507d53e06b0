"""Runs LinuxCNC's HAL isolated in its own processes and memory, because a computer can run only one HAL."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# LinuxCNC's modules are installed for the system's Python.
PYTHON = "/usr/bin/python3"
# A user without privileges: as root, HAL runs only if it is given another user.
_NOBODY = "65534"
_ALONE = ["unshare", "--pid", "--fork", "--kill-child", "--mount-proc", "--ipc", "--net"]


def missing() -> str | None:
    """Why HAL cannot run here, in one sentence; None if it can."""
    if shutil.which("halrun") is None:
        return "LinuxCNC is not installed: apt-get install linuxcnc-uspace"
    found = subprocess.run([PYTHON, "-c", "import hal; hal.stream"], env=_clean(), capture_output=True)
    if found.returncode:
        return f"{PYTHON} has no module hal with streams: apt-get install linuxcnc-uspace 2.9 or newer"
    if not alone() and subprocess.run(["pgrep", "-x", "rtapi_app"], capture_output=True).returncode == 0:
        return "another program uses HAL on this computer, where HAL runs once: end it"
    return None


def alone() -> list[str]:
    """The start of a command that isolates the processes, shared memory and ports of the command after it,
    which all end with it; empty if the system does not allow that."""
    allowed = shutil.which("unshare") and subprocess.run([*_ALONE, "true"], capture_output=True)
    return _ALONE if allowed and allowed.returncode == 0 else []


@contextmanager
def folder_and_environment() -> Iterator[tuple[Path, dict[str, str]]]:
    """A folder that HAL's user may write to, and HAL's environment variables with its socket in the
    folder."""
    # Not in /tmp, where LinuxCNC keeps its lock file.
    with tempfile.TemporaryDirectory(prefix="hal", dir="/var/tmp") as place:
        os.chmod(place, 0o777)
        user = {"RTAPI_UID": _NOBODY} if os.getuid() == 0 else {}
        own = {"RTAPI_FIFO_PATH": f"{place}/socket", "HOME": place}
        yield Path(place), _clean() | user | own


def _clean() -> dict[str, str]:
    """The environment without the variables of this Python."""
    return {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
