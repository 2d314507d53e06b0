"""The native module runs on other processors and older systems than its builder, and gives equal plans.

`make wheel` runs these tests on its wheel too.
"""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from feedplan import _solvers

# The folder in which `make wheel` has built the wheels.
WHEELS = os.environ.get("FEEDPLAN_WHEELS")
wheels = pytest.mark.skipif(WHEELS is None, reason="make wheel builds wheels and checks them")
linux = pytest.mark.skipif(sys.platform != "linux", reason="of ELF files")
x86 = pytest.mark.skipif(platform.machine() != "x86_64", reason="of processors of another kind")
# A processor with the instructions of x86-64-v2 and no wider vectors. The linear algebra of numpy is told the
# processor, because it would detect that of the host.
NEHALEM = ("qemu-x86_64", "-cpu", "Nehalem", "-E", "OPENBLAS_CORETYPE=Nehalem")
emulator = pytest.mark.skipif(shutil.which(NEHALEM[0]) is None, reason="needs Debian's package qemu-user")
PYTHONS = [f"python3.{minor}" for minor in range(10, 15)]
MACHINES = ["x86_64", "aarch64"]
CONSTRAINTS = Path(__file__).parents[1] / "constraints.txt"
PROGRAM = "G21 G90 G64 P0.05\nG1 F1000\nX10 Y0 Z0\nY10\nG2 X20 Y0 R10\nG1 X30 Y5\nM2\n"
# Prints time and hash of all setpoints for each method; these use different planners and paths.
PLANS = """
import hashlib, json, feedplan
def shown(method):
    plan = feedplan.plan("part.ngc", "mill", method)
    bits = b"".join(chunk.position.tobytes() for chunk in plan.setpoints())
    return [plan.time, hashlib.sha256(bits).hexdigest(), plan.audit().ok]
print(json.dumps({method: shown(method) for method in ("bang-bang", "jerk-limited", "s-curve")}))
"""


def plans(command: list[str], folder: Path, **settings: str) -> dict[str, list[object]]:
    """The output of a Python for the script PLANS, with these settings in its environment."""
    (folder / "part.ngc").write_text(PROGRAM, encoding="ascii")
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    done = subprocess.run(
        [*command, "-c", PLANS], cwd=folder, env=clean | settings, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    found: dict[str, list[object]] = json.loads(done.stdout)
    return found


def own_plans(folder: Path, emulator: tuple[str, ...] = ()) -> dict[str, list[object]]:
    """The output for PLANS with the native module of this package."""
    package = Path(_solvers.__file__).parent
    return plans([*emulator, sys.executable], folder, PYTHONPATH=str(package.parent))


@linux
@x86
def test_only_what_is_chosen_at_run_time_needs_wider_vectors_than_the_baseline() -> None:
    # All instructions of AVX and later begin with v. The crates of these functions check the processor first.
    chosen = re.compile("vectorize_avx2|vectorize_avx512|fma_with_fma")
    done = subprocess.run(
        ["objdump", "-d", "--no-show-raw-insn", _solvers.__file__], capture_output=True, text=True, check=True
    )
    functions = [function for function in done.stdout.split("\n\n") if "\tv" in function]
    found = {function.partition("\n")[0] for function in functions}
    assert {name for name in found if not chosen.search(name)} == set()
    assert any("vectorize_avx512" in name for name in found)


@linux
@x86
@emulator
def test_a_processor_without_wide_vectors_plans_the_same(tmp_path: Path) -> None:
    assert own_plans(tmp_path, NEHALEM) == own_plans(tmp_path)


def wheel(machine: str = platform.machine()) -> Path:
    """The wheel for a kind of processor."""
    found = list(Path(str(WHEELS)).glob(f"*{machine}.whl"))
    if not found:
        pytest.skip(f"no wheel for {machine}")
    return found[0].resolve()


@wheels
@linux
@pytest.mark.parametrize("machine", MACHINES)
def test_the_wheel_asks_for_no_newer_system_than_it_says(machine: str, tmp_path: Path) -> None:
    assert wheel(machine).name.endswith(f"-cp310-abi3-manylinux_2_28_{machine}.whl")
    shutil.unpack_archive(wheel(machine), tmp_path, "zip")
    done = subprocess.run(
        ["objdump", "-T", tmp_path / "feedplan" / "_solvers.abi3.so"],
        capture_output=True,
        text=True,
        check=True,
    )
    versions = {tuple(map(int, version.split("."))) for version in re.findall(r"GLIBC_([\d.]+)", done.stdout)}
    assert (2, 17) < max(versions) <= (2, 28)


@wheels
@pytest.mark.parametrize("name", PYTHONS)
def test_the_wheel_installs_and_plans_the_same_in_a_bare_environment(name: str, tmp_path: Path) -> None:
    base = shutil.which(name)
    if base is None or subprocess.run([base, "-c", "import ensurepip"], capture_output=True).returncode:
        pytest.skip(f"{name} is not there")
    home = tmp_path / "bare"
    subprocess.run([base, "-m", "venv", home], check=True)
    python = str(home / "bin" / "python")
    subprocess.run([python, "-m", "pip", "install", "--quiet", wheel()], check=True)
    expected = own_plans(tmp_path)
    assert plans([python], tmp_path) == expected
    if shutil.which(NEHALEM[0]) and platform.machine() == "x86_64":
        assert plans([*NEHALEM, python], tmp_path) == expected


def arm_python(folder: Path) -> list[str]:
    """Debian's Python for ARM64, unpacked into a folder and run by an emulator."""
    status = folder / "status"
    status.touch()
    directories = {"State": folder, "State::status": status, "Cache": folder}
    apt = ["apt-get", "--quiet=2", "-oAPT::Architecture=arm64", "-oAPT::Architectures=arm64"]
    apt += [f"-oDir::{name}={place}" for name, place in directories.items()]
    subprocess.run([*apt, "update"], check=True)
    install = [*apt, "install", "--yes", "--download-only", "--no-install-recommends"]
    subprocess.run([*install, "python3", "libstdc++6"], check=True)
    root = folder / "root"
    for package in folder.glob("archives/*.deb"):
        subprocess.run(["dpkg", "--extract", package, root], check=True)
    return ["qemu-aarch64", "-L", str(root), str((root / "usr" / "bin" / "python3").resolve())]


@wheels
@linux
@pytest.mark.skipif(shutil.which("qemu-aarch64") is None, reason="needs Debian's package qemu-user")
@pytest.mark.skipif(shutil.which("apt-get") is None, reason="takes Python for ARM64 from Debian")
def test_the_wheel_plans_the_same_on_arm(tmp_path: Path) -> None:
    built = wheel("aarch64")
    python = arm_python(tmp_path)
    version = re.findall(r"python(3\.\d+)$", python[-1])[0]
    site = tmp_path / "site"
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target", site]
    foreign = ["--platform=manylinux_2_28_aarch64", "--platform=manylinux_2_27_aarch64"]
    foreign += ["--only-binary=:all:", f"--python-version={version}", f"--constraint={CONSTRAINTS}"]
    subprocess.run([*install, *foreign, "numpy", built], check=True)
    found = plans(python, tmp_path, PYTHONPATH=str(site))
    assert found == own_plans(tmp_path)
