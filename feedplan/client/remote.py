"""A plan on a service: its figures are stored here, its setpoints and report are loaded when used."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any

from feedplan.arguments import refuse
from feedplan.audit import Audit
from feedplan.client.transport import Transport
from feedplan.outputs import FormatName, formats_named, npz
from feedplan.outputs._staging import staged
from feedplan.plan_folder import SUMMARY_FILE, summary_text
from feedplan.progress import Progress, of_stage, tell
from feedplan.report.page import FILE as REPORT_FILE
from feedplan.setpoints import SetpointChunk, chunks


class RemotePlan:
    """A plan on a service, the result of the job `id`. Its attributes are those of `feedplan.planning.Plan`,
    but without the exact motion (`at`): `time` [s], including dwells; `lower_bound` [s] of the time of every
    feasible profile of this path; `gap`, (time − lower_bound) / time; `method`, and the `options` of the
    plan; `compute`, the computing time of each stage [s]; `warnings`, sentences for the user."""

    def __init__(self, transport: Transport, job: Mapping[str, Any]) -> None:
        self._transport = transport
        self.id = str(job["id"])
        self._address = f"/v1/jobs/{self.id}"
        self._summary: dict[str, Any] = transport.json("GET", f"{self._address}/result")[1]
        self.time, self.lower_bound, self.gap = (
            float(self._summary[name]) for name in ("time", "lower_bound", "gap")
        )
        self.method: str = self._summary["method"]
        self.options: dict[str, Any] = self._summary["options"]
        self.compute: dict[str, float] = self._summary["compute"]
        self.warnings = tuple(self._summary["warnings"])

    def __repr__(self) -> str:
        return (
            f"<RemotePlan of {self._summary['program']} on {self._summary['machine']} by {self.method}: "
            f"{self.time:.6g} s, gap {100 * self.gap:.3g} %, at {self._transport.url}>"
        )

    def summary(self) -> dict[str, Any]:
        """The content of plan.json."""
        return dict(self._summary)

    def audit(self, progress: Progress | None = None) -> Audit:
        """The audit that the service has made."""
        points = self._summary["setpoints"]
        units = dict(zip(points["axes"], points["units"], strict=True))
        return Audit.from_json(self._summary["audit"], units, self._summary["units"]["length"])

    def setpoints(self, period: float | None = None) -> RemoteSetpoints:
        """The setpoints, which are loaded from the service when they are read.

        Raises InputError for another period than that of the plan.
        """
        own = float(self._summary["setpoints"]["period"])
        if period is not None and period != own:
            raise refuse("the period", period, f"{own:g} s, that of the plan, or plan with another one")
        return RemoteSetpoints(self._transport, self._address, self._summary["setpoints"])

    def report(self) -> str:
        """The report, a page of HTML."""
        with self._transport.request("GET", f"{self._address}/report") as response:
            return response.read().decode()

    def write(
        self,
        folder: FilePath,
        formats: Sequence[FormatName],
        progress: Progress | None = None,
    ) -> tuple[FilePath, ...]:
        """Writes the folder that `feedplan.write_plan` writes; returns the files."""
        share = of_stage(progress, "write")
        outputs = formats_named(formats)
        tell(share, 0.0)
        with staged(folder, last=SUMMARY_FILE) as stage:
            for number, (name, output) in enumerate(outputs.items()):
                self._transport.download(f"{self._address}/setpoints", stage / output.FILE, {"format": name})
                tell(share, (number + 1) / (len(outputs) + 1))
            self._transport.download(f"{self._address}/report", stage / REPORT_FILE)
            (stage / SUMMARY_FILE).write_text(summary_text(self._summary), encoding="utf-8")
            names = sorted(file.name for file in stage.iterdir())
        tell(share, 1.0)
        return tuple(folder / name for name in names)


class RemoteSetpoints:
    """The setpoints of a plan on a service, as `feedplan.Setpoints`: iterating gives chunks."""

    def __init__(self, transport: Transport, address: str, about: Mapping[str, Any]) -> None:
        self._transport, self._address = transport, address
        self.axes = tuple(about["axes"])
        self.period, self.count, self.duration = about["period"], int(about["count"]), about["duration"]
        self._chunk: SetpointChunk | None = None

    def __len__(self) -> int:
        return self.count

    def __repr__(self) -> str:
        return f"<RemoteSetpoints: {self.count} of {' '.join(self.axes)}, one every {self.period:g} s>"

    def __iter__(self) -> Iterator[SetpointChunk]:
        return self.chunks()

    def all(self) -> SetpointChunk:
        """The whole stream as one chunk, from a file that is mapped into memory."""
        if self._chunk is None:
            folder = FilePath(tempfile.mkdtemp(prefix="feedplan-"))
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
            self._transport.download(f"{self._address}/setpoints", folder / npz.FILE)
            self._chunk = npz.load(folder / npz.FILE)
        return self._chunk

    def chunks(self, size: int = 100_000) -> Iterator[SetpointChunk]:
        """The stream in chunks of `size` setpoints, the last one shorter. Raises InputError for a size out of
        range."""
        return chunks(lambda start, stop: self.all().part(slice(start, stop), self.axes), self.count, size)
