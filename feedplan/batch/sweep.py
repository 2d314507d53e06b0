"""Lists the plans of a batch: every program on every machine, at every tolerance, by every method."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path as FilePath
from typing import Any

from feedplan import __version__
from feedplan.arguments import printable
from feedplan.batch.names import Names, safe_name
from feedplan.errors import InputError
from feedplan.jobs.order import Job, Order
from feedplan.machine.machine import Machine
from feedplan.outputs import formats_named
from feedplan.plan_folder import SUMMARY_FILE
from feedplan.planners import given_options, options_of
from feedplan.planning import OF_ALL_METHODS
from feedplan.program.machine_for import AUTO

# Files of a batch; no folder of a plan has these names.
JOURNAL, TABLE, SUMMARY = "batch.jsonl", "batch.csv", "batch.json"


@dataclass(frozen=True)
class Sweep:
    """`programs` are files; `machines` are (name, text of the file); the tolerance None is the program's own.

    `options` are keywords of `feedplan.plan` for all plans; a method gets those that it takes. `reading` has
    keywords of `read_program` except the files, which are `tool_table` and `subprograms`.
    """

    programs: Sequence[FilePath]
    machines: Sequence[tuple[str, str]]
    tolerances: Sequence[float | None]
    methods: Sequence[str]
    options: Mapping[str, Any] = field(default_factory=dict)
    reading: Mapping[str, Any] = field(default_factory=dict)
    formats: tuple[str, ...] = ("npz",)
    tool_table: FilePath | None = None
    subprograms: tuple[FilePath, ...] = ()

    def __post_init__(self) -> None:
        formats_named(self.formats)
        for name, value in self.options.items():
            takers = [method for method in self.methods if self._takes(method, name)]
            if not takers:
                given_options(self.methods[0], {name: value}, OF_ALL_METHODS)
                raise InputError(f"no method of these takes {name}: leave it out")

    def __len__(self) -> int:
        return len(self.programs) * len(self.machines) * len(self.tolerances) * len(self.methods)

    def items(self, folder: FilePath) -> Iterator[Item]:
        """All plans of the sweep, with folders in `folder`; equal sweeps have equal items."""
        names = Names((JOURNAL, TABLE, SUMMARY))
        swept = [len(own) > 1 for own in (self.machines, self.tolerances, self.methods)]
        for program, (machine, text), tolerance, method in product(
            self.programs, self.machines, self.tolerances, self.methods
        ):
            values = (machine, "own" if tolerance is None else f"{tolerance:g}", method)
            parts = [value for value, varies in zip(values, swept, strict=True) if varies]
            name = names.own(safe_name(program.name, parts))
            options = {key: value for key, value in self.options.items() if self._takes(method, key)}
            if tolerance is not None:
                options["tolerance"] = tolerance
            order = Order(printable(program.name), text, method, options, self.reading, self.formats)
            job = Job(
                order, program, folder / name, self.tool_table, (program.absolute().parent, *self.subprograms)
            )
            yield Item(printable(str(program)), machine, tolerance, method, job)

    @staticmethod
    def _takes(method: str, name: str) -> bool:
        return name in OF_ALL_METHODS or name in options_of(method)


@dataclass(frozen=True)
class Item:
    """One plan of a batch."""

    program: str
    machine: str
    tolerance: float | None
    method: str
    job: Job

    @property
    def folder(self) -> str:
        """The name of its folder."""
        return self.job.folder.name

    @property
    def files(self) -> list[FilePath]:
        """The files that its folder has after planning, except the report."""
        outputs = formats_named(self.job.order.formats).values()
        return [self.job.folder / name for name in (SUMMARY_FILE, *(output.FILE for output in outputs))]

    def fingerprint(self) -> str:
        """A hash that is equal for equal plans; files that a program calls are not part of it.

        Raises OSError if a file cannot be read.
        """
        parts = [__version__, self.job.order.text(), _hash(self.job.program)]
        if self.job.tool_table is not None:
            parts.append(_hash(self.job.tool_table))
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def _hash(file: FilePath) -> str:
    with file.open("rb") as stream:
        sha256 = hashlib.sha256()
        while part := stream.read(1 << 20):
            sha256.update(part)
    return sha256.hexdigest()


def machine_text(name: str) -> tuple[str, str]:
    """The name of a machine and the text of its file; the text of `auto` is `auto`. Raises MachineError."""
    if name == AUTO:
        return AUTO, AUTO
    machine = Machine.load(name)
    return machine.name, machine.to_toml()
