"""The public names of the package: their kinds, signatures and docstrings."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import pydoc
import re
import subprocess
import sys
from importlib.metadata import version
from types import ModuleType
from typing import get_args, get_type_hints

import grimp
import pytest

import feedplan
from feedplan import outputs, planners
from feedplan.machine.axis import Axis, AxisKind
from feedplan.outputs import formats
from feedplan.planners import options_of
from feedplan.planning import OF_ALL_METHODS
from feedplan.setpoints import INTERPOLATORS


def test_every_public_name_exists_and_no_other_is_shown() -> None:
    for name in feedplan.__all__:
        assert hasattr(feedplan, name)
    shown = [name for name in dir(feedplan) if not name.startswith("__")]
    assert shown == sorted(feedplan.__all__)


def test_no_module_hides_a_public_name() -> None:
    before = {name: getattr(feedplan, name) for name in feedplan.__all__}
    for module in pkgutil.walk_packages(feedplan.__path__, "feedplan."):
        if module.name.count(".") == 1 and not module.name.endswith("__main__"):
            importlib.import_module(module.name)
            assert module.name.partition(".")[2] not in feedplan.__all__
    assert {name: getattr(feedplan, name) for name in feedplan.__all__} == before
    assert inspect.isfunction(feedplan.plan)
    assert inspect.isfunction(feedplan.compare)


def test_the_version_is_that_of_the_distribution() -> None:
    assert feedplan.__version__ == version("feedplan")


def test_the_package_imports_no_slow_package() -> None:
    slow = {
        "click",
        "rich",
        "scipy",
        "toppra",
        "casadi",
        "ruckig",
        "clarabel",
        "importlib.metadata",
        "http.client",
        "sqlite3",
        "fastapi",
        "pydantic",
        "distributed",
        "multiprocessing",
    }
    code = f"import sys, feedplan; feedplan.__version__; print(sorted({slow} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_nothing_is_imported_before_a_name_is_used() -> None:
    """`main` must run before slow imports, so that Ctrl-C during them ends in one sentence."""
    code = """
import sys, feedplan, feedplan.__main__
print(sorted(name for name in sys.modules if name == "numpy" or name.startswith("feedplan.")))
feedplan.Axis
print("numpy" in sys.modules, "feedplan.planning" in sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "['feedplan.__main__']\nTrue False\n"


def test_packages_of_the_service_stay_in_the_service() -> None:
    code = """
import importlib, pkgutil, sys, feedplan
for module in pkgutil.walk_packages(feedplan.__path__, "feedplan."):
    if not module.name.startswith("feedplan.service."):
        importlib.import_module(module.name)
print(sorted({"fastapi", "pydantic", "sqlite3", "starlette", "uvicorn"} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_package_of_clusters_is_imported_where_one_is_used() -> None:
    code = """
import importlib, pkgutil, sys, feedplan
for module in pkgutil.walk_packages(feedplan.__path__, "feedplan."):
    importlib.import_module(module.name)
print(sorted({"dask", "distributed"} & set(sys.modules)))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_machines_and_methods_are_named() -> None:
    assert feedplan.machines()[:2] == ("corexy", "cylindrical")
    assert all(feedplan.Machine.load(name).name == name for name in feedplan.machines())
    assert {"bang-bang", "jerk-limited", "toppra"} <= set(feedplan.methods())


def modules_of(package: ModuleType) -> tuple[str, ...]:
    names = sorted(module.name.replace("_", "-") for module in pkgutil.iter_modules(package.__path__))
    return tuple(name for name in names if not name.startswith("-"))


def test_literal_types_list_all_names() -> None:
    assert feedplan.methods() == modules_of(planners)
    assert formats() == modules_of(outputs)
    assert INTERPOLATORS == ("sarfraz", "newton")
    assert get_args(AxisKind) == ("linear", "rotary")
    for function, argument in ((feedplan.plan, "method"), (Axis, "kind")):
        assert "Literal" in str(get_type_hints(function)[argument])


def test_help_tells_the_options_of_every_method_with_their_defaults() -> None:
    text = pydoc.render_doc(feedplan.plan, renderer=pydoc.plaintext)
    text = re.sub(r",\n +(?=\w+=)", ", ", text)  # joins options that are written in several lines
    rows = {
        name: row
        for names, row in re.findall(r"^ *((?:[a-z]+(?:-[a-z]+)*(?:, )?)+)  +(\w+=.*)$", text, flags=re.M)
        for name in names.split(", ")
    }
    for method in feedplan.methods():
        options = options_of(method)
        told = dict(re.findall(r"(\w+)=([^,]+)", rows.pop(method, "")))
        assert set(told) == set(options), method
        assert {name: eval(value) for name, value in told.items()} == options
    assert rows == {}
    for name in OF_ALL_METHODS:
        assert f"`{name}" in text


@pytest.mark.parametrize(
    ("method", "options", "sentence"),
    [
        ("bang-bang", {"speed": 3}, r"bang-bang takes no speed: give tolerance, feed, .*, or leave it out$"),
        (
            "clarabel",
            {"scheme": 3},
            r"clarabel takes no scheme: leave it out, or choose a method that takes it \(toppra\)$",
        ),
        ("jerk-limited", {"reserve": len}, r"jerk-limited takes no reserve: give accuracy, time_limit, tol"),
        ("bang-bang", {"tollerance": None}, r"bang-bang takes no tollerance: give tolerance, "),
        ("junction-deviation", {"deviation": 0}, r"the junction deviation is 0 mm: give a positive number"),
        ("toppra", {"scheme": "two"}, r"no scheme of toppra 'two': use one of one-sided, collocation$"),
    ],
)
def test_an_option_that_a_method_does_not_take_is_refused_with_those_it_takes(
    method: str, options: dict[str, object], sentence: str
) -> None:
    with pytest.raises(feedplan.InputError, match=sentence):
        feedplan.plan("G21 G1 F100 X10\nM2\n", "mill", method, **options)


def test_options_reach_the_method_and_stand_in_the_plan() -> None:
    program = "G21 G90 G64 P0.01 F6000\nG1 X20\nY20\nX40\nM2\n"
    slow, fast = (
        feedplan.plan(program, "mill", "junction-deviation", square_corner_velocity=speed)
        for speed in (1.0, 9.0)
    )
    assert fast.time < slow.time
    assert slow.options["square_corner_velocity"] == 1.0
    assert slow.options["deviation"] == 0.01
    assert "accuracy" not in slow.options


def test_no_module_imports_itself_through_others() -> None:
    graph = grimp.build_graph("feedplan", cache_dir=None)
    left = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    while ends := [module for module, imported in left.items() if not imported & left.keys()]:
        for module in ends:
            del left[module]
    assert sorted(left) == []
