"""The limits of the service; errors and command-line options use the same names."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field, fields
from typing import Any

MB = 1_000_000


def _limit(default: float, unit: str, help: str, least: float) -> Any:
    return field(default=default, metadata={"unit": unit, "help": help, "least": least})


@dataclass(frozen=True)
class Limits:
    """The limits of a service; each has the type of its default."""

    max_upload: float = _limit(256.0, "MB", "Greatest size of a request with its program.", 0.001)
    max_upload_time: float = _limit(300.0, "s", "Time within which a whole request must arrive.", 0.01)
    max_blocks: int = _limit(5_000_000, "lines", "Most lines of a program.", 1)
    max_moves: int = _limit(10_000_000, "moves", "Most moves of a program, in loops and calls too.", 1)
    max_setpoints: int = _limit(20_000_000, "setpoints", "Most setpoints of a plan.", 1)
    max_time: float = _limit(600.0, "s", "Time limit of a job.", 0.01)
    max_memory: float = _limit(4000.0, "MB", "Memory limit of the process of a job.", 1.0)
    max_queue: int = _limit(100, "jobs", "Most jobs that may wait.", 1)
    max_disk: float = _limit(20_000.0, "MB", "Greatest size of all jobs that are kept.", 0.001)
    keep_days: float = _limit(30.0, "days", "Time for which a job is kept after its end.", 0.0)
    workers: int = _limit(min(4, os.cpu_count() or 1), "processes", "Most jobs that run at the same time.", 1)

    def named_in(self, sentence: str) -> dict[str, Any] | None:
        """Name, value and unit of the limit that a sentence names; None if it names none."""
        for own in fields(self):
            if re.search(rf"\b{own.name}\b", sentence):
                return {"name": own.name, "value": getattr(self, own.name), "unit": own.metadata["unit"]}
        return None

    def to_json(self) -> dict[str, dict[str, Any]]:
        """All limits with their values and units."""
        return {
            own.name: {"value": getattr(self, own.name), "unit": own.metadata["unit"]} for own in fields(self)
        }
