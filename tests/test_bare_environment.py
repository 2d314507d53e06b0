"""feedplan in an environment with only numpy, click and rich."""

from __future__ import annotations

import json
import os
import re
import subprocess
import venv
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

import feedplan
from feedplan.report.page import missing_pictures

NEEDED = ("numpy", "click", "rich", "tomli")
# Packages that methods need, with the command that installs each.
INSTALLS = {name: f"`pip install {name}`" for name in ("casadi", "clarabel", "ruckig", "toppra")}
NATIVE = [name for name in feedplan.methods() if name not in INSTALLS]
PROGRAM = "G21 G90 G64 P0.05\nG1 F1000\nX10 Y0 Z0\nY10\nG2 X20 Y0 R10\nM2\n"


def _with_dependencies(names: tuple[str, ...]) -> set[str]:
    """The installed distributions of these names, with all their dependencies."""
    found: set[str] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        try:
            needs = distribution(name).requires or []
        except PackageNotFoundError:
            continue  # it is for another platform or another Python
        if name not in found:
            found.add(name)
            waiting += [re.split(r"[^\w.-]", need)[0] for need in needs if "extra ==" not in need]
    return found


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The Python of a virtual environment without pip that has links to these packages and to feedplan."""
    home: Path = tmp_path_factory.mktemp("bare")
    venv.create(home, symlinks=True, with_pip=False)
    site = next(home.glob("lib/python*/site-packages"))
    for name in _with_dependencies(NEEDED):
        files = distribution(name)
        for top in {
            file.parts[0] for file in files.files or () if file.parts[0] not in ("..", "__pycache__")
        }:
            (site / top).symlink_to(Path(str(files.locate_file(top))))
    (site / "feedplan").symlink_to(Path(feedplan.__file__).parent)
    return home / "bin" / "python"


def run(python: Path, *arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    return subprocess.run(
        [python, *arguments], cwd=folder, env=clean, capture_output=True, text=True, check=False, timeout=120
    )


@pytest.fixture
def part(tmp_path: Path) -> Path:
    file = tmp_path / "part.ngc"
    file.write_text(PROGRAM)
    return file


def test_the_environment_has_no_other_package(python: Path, tmp_path: Path) -> None:
    names = [*INSTALLS, "scipy", "ezdxf", "pytest"]
    code = f"import importlib.util as u; print([n for n in {names} if u.find_spec(n)])"
    done = run(python, "-c", code, folder=tmp_path)
    assert (done.stdout, done.stderr) == ("[]\n", "")


def test_plan_check_fit_and_machines_work(python: Path, part: Path) -> None:
    missing = bool(missing_pictures())
    told = f"warning: {missing_pictures()}\n" if missing else ""
    for method in ("bang-bang", "jerk-limited"):
        out = part.parent / method
        arguments = ["plan", "part.ngc", "--method", method, "-o", method]
        done = run(python, "-m", "feedplan", *arguments, folder=part.parent)
        assert (done.returncode, done.stderr) == (0, told)
        assert "audit        passed" in done.stdout
        assert json.loads((out / "plan.json").read_text())["audit"]["ok"]
        report = (out / "report.html").read_text(encoding="utf-8")
        assert "Audit passed" in report
        assert ('class="chart"' in report) is not missing
        done = run(python, "-m", "feedplan", "check", method, folder=part.parent)
        assert (done.returncode, done.stderr) == (0, "")
    for arguments in (["fit", "part.ngc"], ["machines"], ["--version"], ["plan", "--help"]):
        assert run(python, "-m", "feedplan", *arguments, folder=part.parent).returncode == 0


def test_every_native_method_plans_and_each_missing_package_is_one_sentence(python: Path, part: Path) -> None:
    done = run(python, "-m", "feedplan", "compare", "part.ngc", "-o", "comparison", folder=part.parent)
    assert done.returncode == 0
    assert [line.split()[0] for line in done.stdout.splitlines()[1:-2]] == NATIVE
    missing = [line for line in done.stderr.splitlines() if not line.startswith("warning")]
    assert [line.split(":")[0] for line in missing] == list(INSTALLS)
    for line, (name, command) in zip(missing, INSTALLS.items(), strict=True):
        assert line.startswith(f"{name}: the method {name} needs the package {name}")
        assert line.endswith(f": {command}")
    page = (part.parent / "comparison" / "comparison.html").read_text(encoding="utf-8")
    assert all(f"<b>{method}</b>" in page for method in NATIVE)


def test_one_missing_package_ends_the_command_with_its_sentence(python: Path, part: Path) -> None:
    for name, command in INSTALLS.items():
        done = run(python, "-m", "feedplan", "plan", "part.ngc", "--method", name, folder=part.parent)
        assert (done.returncode, done.stdout) == (2, "")
        assert re.fullmatch(rf"error: the method {name} needs the package {name}.*: {command}\n", done.stderr)
    (part.parent / "drawing.dxf").write_text("0\nSECTION\n")
    done = run(python, "-m", "feedplan", "plan", "drawing.dxf", folder=part.parent)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert done.stderr.endswith(": pip install feedplan[dxf]\n")


def test_the_service_names_its_packages_and_its_client_needs_none(python: Path, part: Path) -> None:
    done = run(python, "-m", "feedplan", "serve", folder=part.parent)
    assert (done.returncode, done.stdout) == (2, "")
    assert re.fullmatch(
        r"error: the service needs the package \w+: `pip install feedplan\[serve\]`\n", done.stderr
    )
    done = run(
        python, "-m", "feedplan", "plan", "part.ngc", "--server", "http://127.0.0.1:9", folder=part.parent
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: the service at http://127.0.0.1:9 cannot be reached")


def test_a_batch_needs_no_package_and_a_cluster_names_its_package(python: Path, part: Path) -> None:
    done = run(python, "-m", "feedplan", "batch", "part.ngc", "-o", "out", "-q", folder=part.parent)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert (part.parent / "out" / "part" / "plan.json").exists()
    at = ["--cluster", "127.0.0.1:8786"]
    for command in (["batch", "part.ngc", "-o", "out"], ["plan", "part.ngc", "--method", "jerk-limited"]):
        done = run(python, "-m", "feedplan", *command, *at, folder=part.parent)
        assert (done.returncode, done.stdout) == (2, "")
        assert re.fullmatch(
            r"error: a cluster needs the package \w+: `pip install feedplan\[cluster\]`\n", done.stderr
        )


def test_a_notebook_and_path_files_work(python: Path, part: Path) -> None:
    code = """
import feedplan
plan = feedplan.plan("part.ngc", "mill")
print(plan.audit().ok, len(plan.setpoints()) > 100, "<svg" in plan._repr_html_(), plan.at(0.1).position.shape)
print(feedplan.plan(b'{"curves": [{"degree": 1, "control_points": [[0, 0], [9, 0]]}]}', "mill"))
"""
    done = run(python, "-c", code, folder=part.parent)
    assert done.stderr == ""
    assert done.stdout.splitlines()[0] == "True True True (3,)"
    assert done.stdout.splitlines()[1].startswith("<Plan of program on mill by bang-bang: ")
