"""Versions of everything that is installed are pinned exactly, by name and version only."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOLVERS = ROOT / "solvers"
PINS = SOLVERS / "pins"


def test_no_pin_names_an_address() -> None:
    files = [
        *SOLVERS.glob("*/Cargo.toml"),
        SOLVERS / "Cargo.toml",
        ROOT / "constraints.txt",
        ROOT / "page" / "package-lock.json",
    ]
    assert [file.name for file in files if "://" in file.read_text("utf-8")] == []


def test_every_crate_of_the_build_is_pinned_at_its_version() -> None:
    if not (SOLVERS / "Cargo.lock").exists():
        pytest.skip("cargo has built nothing here")
    spec = importlib.util.spec_from_file_location("write", PINS / "write.py")
    assert spec is not None
    assert spec.loader is not None
    write = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(write)
    assert (PINS / "Cargo.toml").read_text("utf-8").endswith(write.MARK + write.pins())
