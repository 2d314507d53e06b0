"""An order (machine, method, options) as plain values, and a job: an order with its files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path as FilePath
from typing import Any


@dataclass(frozen=True)
class Order:
    """A description, in plain values, of how to plan a program; it is the same on every computer.

    `name` is that of the program: it is shown in messages, and its ending decides the language; `machine` is
    the text of a machine file, or `auto`; `options` are keywords of `feedplan.plan`, `reading` keywords of
    `read_program` except files; `formats` are those of the setpoints; with `drawing` the data of a page is
    written too.
    """

    name: str
    machine: str
    method: str
    options: Mapping[str, Any] = field(default_factory=dict)
    reading: Mapping[str, Any] = field(default_factory=dict)
    formats: tuple[str, ...] = ("npz",)
    drawing: bool = False

    def text(self) -> str:
        """The order as JSON; equal orders have equal texts."""
        return json.dumps(asdict(self), sort_keys=True)

    @staticmethod
    def of(text: str) -> Order:
        """The order from a text made by `text`."""
        table = json.loads(text)
        return Order(**{**table, "formats": tuple(table["formats"])})


@dataclass(frozen=True)
class Job:
    """An order with its files: the `program`, the `tool_table`, the folders of `subprograms` that the program
    may call, and the `folder` of its plan, which is written completely or not at all."""

    order: Order
    program: FilePath
    folder: FilePath
    tool_table: FilePath | None = None
    subprograms: tuple[FilePath, ...] = ()

    def text(self) -> str:
        """The job as JSON."""
        return json.dumps(
            {
                "order": self.order.text(),
                "program": str(self.program),
                "folder": str(self.folder),
                "tool_table": None if self.tool_table is None else str(self.tool_table),
                "subprograms": [str(folder) for folder in self.subprograms],
            }
        )

    @staticmethod
    def of(text: str | bytes) -> Job:
        """The job from a text made by `text`."""
        table = json.loads(text)
        return Job(
            Order.of(table["order"]),
            FilePath(table["program"]),
            FilePath(table["folder"]),
            None if table["tool_table"] is None else FilePath(table["tool_table"]),
            tuple(map(FilePath, table["subprograms"])),
        )
