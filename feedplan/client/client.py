"""The calls of the package, made by a service.

client = feedplan.Client("http://127.0.0.1:8000")
plan = client.plan("part.ngc", "mill", method="jerk-limited")
plan.time, plan.lower_bound, plan.audit().ok
client.write_plan(plan, "part")
"""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any, cast

from feedplan.arguments import callback, file_path, instance, list_of_names, number, positive, refuse
from feedplan.client.remote import RemotePlan
from feedplan.client.transport import Transport, error_of, form
from feedplan.comparison import TIME_LIMIT, Row
from feedplan.errors import (
    FeedplanError,
    InfeasibleError,
    InputError,
    MissingPackageError,
    SolverError,
    unreadable,
)
from feedplan.geometry.corners import FollowedPath
from feedplan.geometry.path import Path
from feedplan.machine.controller import Controller
from feedplan.machine.machine import Machine
from feedplan.outputs import FormatName
from feedplan.planners import MethodName, options_of
from feedplan.planners import methods as all_methods
from feedplan.planning import Plan
from feedplan.planning import plan as local_plan
from feedplan.program.program import Program
from feedplan.program.read import Reading, checked_reading
from feedplan.program.source import Source, content_of
from feedplan.progress import Progress
from feedplan.setpoints import MAX_SETPOINTS, Interpolator

# The longest time without an answer of the service [s]; while a job runs it sends something every 15 s.
SILENCE = 60.0
# The defaults of `feedplan.plan`, which are not sent.
_USUAL: dict[str, Any] = dict(local_plan.__kwdefaults__ or {})


class Client:
    """A service at an address such as http://127.0.0.1:8000, with its `token` if it has one.

    `timeout` [s] is the longest time without an answer of the service. All methods raise FeedplanError with
    one sentence if the service cannot be reached or refuses the request; a wrong program gives the same error
    as `feedplan.plan`.
    """

    def __init__(self, url: str, token: str | None = None, *, timeout: float = SILENCE) -> None:
        self._line = Transport(url, token, number(timeout, "the timeout", "a positive number", positive, "s"))

    def __repr__(self) -> str:
        return f"<Client of {self._line.url}>"

    def plan(
        self,
        source: Source | Program,
        machine: Machine | str | os.PathLike[str],
        method: MethodName = "bang-bang",
        *,
        tolerance: float | None = None,
        feed: float | None = None,
        feed_override: float = 1.0,
        period: float | None = None,
        start_speed: float = 0.0,
        end_speed: float = 0.0,
        interpolator: Interpolator = "sarfraz",
        max_setpoints: int = MAX_SETPOINTS,
        path: FollowedPath = "as-fitted",
        path_rounds: int = 1,
        reading: Reading | None = None,
        controller: Controller | Mapping[str, Any] | str | None = None,
        progress: Progress | None = None,
        **options: Any,
    ) -> RemotePlan:
        """The plan of a program, made by the service; the arguments are those of `feedplan.plan`.

        The service accepts only `block_delete`, `whole_step` and the content of a `tool_table` from
        `reading`. Ctrl-C, or an exception from `progress`, cancels the job unless an equal job existed
        before.
        """
        given = {
            "tolerance": tolerance,
            "feed": feed,
            "feed_override": feed_override,
            "period": period,
            "start_speed": start_speed,
            "end_speed": end_speed,
            "interpolator": interpolator,
            "max_setpoints": max_setpoints,
            "path": path,
            "path_rounds": path_rounds,
            "controller": controller,
            **options,
        }
        callback(progress)
        return self._ended(*self._submitted(_program(source), machine, method, given, reading), progress)

    def compare(
        self,
        source: Source | Program,
        machine: Machine | str | os.PathLike[str],
        methods: Sequence[MethodName] | None = None,
        *,
        time_limit: float | None = TIME_LIMIT,
        progress: Progress | None = None,
        **options: Any,
    ) -> tuple[Row, ...]:
        """Plans one program by several methods, as `feedplan.compare` does; the lower bound in each row is
        that of its own plan."""
        chosen = all_methods() if methods is None else list_of_names(methods, "methods", "a list of names")
        reading = checked_reading(options.pop("reading", None))
        options["time_limit"] = time_limit
        program = _program(source)  # a stream can be read only once
        jobs = [
            self._submitted(
                program,
                machine,
                cast(MethodName, method),
                {name: value for name, value in options.items() if name in (*_USUAL, *options_of(method))},
                reading,
            )
            for method in chosen
        ]
        return tuple(
            self._row(cast(MethodName, method), *job, progress)
            for method, job in zip(chosen, jobs, strict=True)
        )

    def write_plan(
        self,
        plan: RemotePlan,
        folder: str | os.PathLike[str],
        formats: Sequence[FormatName] = ("npz",),
        *,
        progress: Progress | None = None,
    ) -> tuple[FilePath, ...]:
        """Loads the files of a plan from the service into a folder, as `feedplan.write_plan` writes it."""
        instance(plan, RemotePlan, "the plan", "what Client.plan returns")
        names = list_of_names(formats, "formats", "a list of names, such as ['npz', 'csv']")
        place = file_path(folder, "the folder", "the path of a folder, as a text or a pathlib.Path")
        return plan.write(place, cast("tuple[FormatName, ...]", names), progress)

    def machines(self) -> tuple[str, ...]:
        """The names of the service's machines."""
        return tuple(row["name"] for row in self._line.json("GET", "/v1/machines")[1]["machines"])

    def methods(self) -> tuple[str, ...]:
        """The names of the service's planning methods."""
        return tuple(row["name"] for row in self._line.json("GET", "/v1/methods")[1]["methods"])

    def health(self) -> dict[str, Any]:
        """Version, number of jobs and limits of the service."""
        return self._table("GET", "/v1/health")

    def jobs(self, state: str | None = None) -> tuple[dict[str, Any], ...]:
        """All jobs, or those in a state (queued, running, done, failed, cancelled), the newest first."""
        found: list[dict[str, Any]] = []
        query: dict[str, Any] = {"count": 200} | ({} if state is None else {"state": state})
        while True:
            page = self._table("GET", "/v1/jobs", query)
            found += page["jobs"]
            if page["before"] is None:
                return tuple(found)
            query["before"] = page["before"]

    def job(self, job: str) -> dict[str, Any]:
        """The progress and the result of a job."""
        return self._table("GET", _address(job))

    def plan_of(self, job: str, progress: Progress | None = None) -> RemotePlan:
        """Waits for the end of a job and returns its plan."""
        return self._ended(self.job(job), False, callback(progress))

    def cancel(self, job: str) -> dict[str, Any]:
        """Stops a job that waits or runs."""
        return self._table("POST", f"{_address(job)}/cancel")

    def delete(self, job: str) -> None:
        """Deletes a job and its files."""
        self._line.json("DELETE", _address(job))

    def _table(self, method: str, address: str, query: Any = None) -> dict[str, Any]:
        return cast("dict[str, Any]", self._line.json(method, address, query)[1])

    def _submitted(
        self,
        program: tuple[bytes, str],
        machine: Machine | str | os.PathLike[str],
        method: MethodName,
        options: dict[str, Any],
        reading: Reading | None,
    ) -> tuple[dict[str, Any], bool]:
        """The job of a program, given as its content and its name, and whether the job is new."""
        fields = {"machine": _machine(machine), "method": str(method)}
        for key, value in checked_reading(reading).items():
            if key == "tool_table" and value is not None:
                fields[key] = _text(cast(Any, value))
            elif key in ("block_delete", "whole_step"):
                options = {**options, key: value}
            elif value:
                raise InputError(f"the service takes no {key}: give the program as one file, or plan it here")
        given = {key: value for key, value in options.items() if value != _USUAL.get(key, ...)}
        try:
            fields["options"] = json.dumps(given, default=_plain)
        except (AttributeError, TypeError, ValueError):
            raise refuse("an option", options, "numbers and names") from None
        body, kind = form(fields, *program)
        # With this key a request that is sent again after a broken connection gives the same job.
        headers = {"Content-Type": kind, "Idempotency-Key": secrets.token_hex(16)}
        status, job = self._line.json("POST", "/v1/jobs", body=body, headers=headers)
        return job, status == 202

    def _ended(self, job: dict[str, Any], is_new: bool, progress: Progress | None) -> RemotePlan:
        """Waits for the end of a job and returns its plan. Raises the error of a job without a plan."""
        try:
            if job["state"] not in ("done", "failed", "cancelled"):
                for kind, data in self._line.events(job["links"]["events"]):
                    if progress and kind == "progress":
                        progress(data["stage"], data["part"])
                job = self.job(job["id"])
        except BaseException as error:
            if is_new and not isinstance(error, FeedplanError):
                self.cancel(job["id"])
            raise
        if job["state"] == "done":
            return RemotePlan(self._line, job)
        problem = job["problem"]
        if problem is None:
            raise InputError(
                f"the job {job['id']} is {job['state']} and the line was broken: ask for plan_of it"
            )
        raise error_of(problem["type"].rpartition(":")[2], problem["detail"], problem["line"])

    def _row(self, method: MethodName, job: dict[str, Any], is_new: bool, progress: Progress | None) -> Row:
        shown = None if progress is None else lambda stage, done: progress(method, done)
        try:
            made = self._ended(job, is_new, shown)
        except (InfeasibleError, MissingPackageError, SolverError) as error:
            return Row(method, None, 0.0, str(error))
        return Row(method, cast(Plan, made), made.lower_bound)


def _program(source: Any) -> tuple[bytes, str]:
    """The content of a program and its name."""
    if isinstance(source, Path):
        raise InputError("a Path stays on this computer: plan it by feedplan.plan, or send a path file")
    if isinstance(source, Program):
        if source.text is None:
            raise InputError(f"{source.name} was not read from a text: plan it by feedplan.plan")
        return content_of(source.text).content, source.name
    content, name, _ = content_of(source)
    return content, name


def _machine(given: Machine | str | os.PathLike[str]) -> str:
    """The machine in a request: a name, or the text of a machine file."""
    if isinstance(given, str) and not (given.endswith(".toml") or "/" in given or "\\" in given):
        return given
    return Machine.of(given).to_toml()


def _text(file: str | os.PathLike[str]) -> str:
    place = file_path(file, "the tool table", "the path of a tool table (.tbl)")
    try:
        return place.read_bytes().decode("utf-8", "replace")
    except OSError as error:
        raise InputError(unreadable(f"the tool table {place}", error, "the path of a .tbl file")) from None


def _plain(value: Any) -> Any:
    """A controller in the form of a machine file, or a NumPy number as a Python number."""
    return {"type": value.name, **value.parameters} if isinstance(value, Controller) else value.item()


def _address(job: object) -> str:
    if not isinstance(job, str) or not job.isalnum() or not job.isascii():
        raise refuse("the job", job, "the id of a job")
    return f"/v1/jobs/{job}"
