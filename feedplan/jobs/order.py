"""What is to be planned, and where the program and its plan are."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path as FilePath
from typing import Any


@dataclass(frozen=True)
class Order:
    """How a program is planned: plain values, the same on every computer.

    `name` of the program stands in messages, its ending tells the language; `machine` is the text of a
    machine file, or `auto`; `options` are keywords of `feedplan.plan`, `reading` of `read_program`, without
    files; `formats` those of the setpoints; with `drawing` what a page draws is written as well.
    """

    name: str
    machine: str
    method: str
    options: Mapping[str, Any] = field(default_factory=dict)
    reading: Mapping[str, Any] = field(default_factory=dict)
    formats: tuple[str, ...] = ("npz",)
    drawing: bool = False

    def text(self) -> str:
        """The order as JSON, equal for equal orders."""
        return json.dumps(asdict(self), sort_keys=True)

    @staticmethod
    def of(text: str) -> Order:
        """The order that `text` has told."""
        table = json.loads(text)
        return Order(**{**table, "formats": tuple(table["formats"])})


@dataclass(frozen=True)
class Job:
    """An order with its files: the `program`, the `folder` that its plan is written to, which appears whole
    or not at all, the `tool_table`, and the folders of `subprograms` that the program may call."""

    order: Order
    program: FilePath
    folder: FilePath
    tool_table: FilePath | None = None
    subprograms: tuple[FilePath, ...] = ()
