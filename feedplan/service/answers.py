"""The types of the service's answers; their names and docstrings are in its documentation."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, Field

State = Literal["queued", "running", "done", "failed", "cancelled"]


class LimitValue(BaseModel):
    """A limit of the service."""

    name: str
    value: float
    unit: str


class Problem(BaseModel):
    """Why a request is refused or a job failed (RFC 9457)."""

    type: str = Field(examples=["urn:feedplan:program"])
    title: str
    status: int
    detail: str = Field(description="One sentence with place, value and remedy")
    file: str | None = None
    line: int | None = Field(None, description="Line of the program, from 1")
    limit: LimitValue | None = None
    remedy: str | None = None


class ProgramInfo(BaseModel):
    """The program of a job."""

    name: str
    sha256: str
    bytes: int
    lines: int


class Figures(BaseModel):
    """The key figures of a plan."""

    time: float = Field(description="Time of the program [s]")
    lower_bound: float = Field(description="No plan of this path is faster [s]")
    gap: float
    ok: bool = Field(description="Whether every limit holds in the audit")
    failures: list[str] = Field(description="A sentence for each limit that is broken")
    machine: str
    setpoints: dict[str, Any] = Field(description="axes, units, period [s], count, duration [s]")
    warnings: list[str]


class Job(BaseModel):
    """A job: its request, its progress and its result."""

    id: str
    state: State
    created: float = Field(description="[s] since 1970")
    started: float | None
    finished: float | None
    program: ProgramInfo
    machine: str
    method: str
    options: dict[str, Any]
    stage: str | None = Field(description="read, fit, plan, audit or write")
    done: float = Field(description="The part of the work that is done, 0 to 1")
    result: Figures | None
    problem: Problem | None
    links: dict[str, str]


class Jobs(BaseModel):
    """Jobs, the newest first; `before` asks for the next ones."""

    jobs: list[Job]
    before: int | None = Field(
        description="Give it as `before` to get the next jobs; null: there are no more"
    )


class ComparedJob(BaseModel):
    """A job as a row of a comparison; `worst` is the greatest use of each kind of limit."""

    id: str
    program: str
    machine: str
    method: str
    state: State
    time: float | None
    lower_bound: float | None
    gap: float | None
    computing: float | None = Field(description="Computing time of the method [s]")
    ok: bool | None
    worst: dict[str, dict[str, Any]]
    error: str | None


class Comparison(BaseModel):
    """Jobs as rows of one table."""

    rows: list[ComparedJob]


class Axis(BaseModel):
    """An axis of a machine; a limit is one number, two if it differs by direction, or null if there is
    none."""

    name: str
    kind: str
    unit: str
    max_velocity: float | list[float]
    max_acceleration: float | list[float]
    max_jerk: float | None
    travel: list[float] | None


class Parameter(BaseModel):
    """A parameter of a controller, with the `option` of the method that it sets."""

    option: str
    default: float | None = Field(description="null: no limit")
    unit: str


class ControllerInfo(BaseModel):
    """A controller that is modelled: the method that models it, with the fixed options of that method."""

    name: str
    method: str
    options: dict[str, Any]
    parameters: dict[str, Parameter]


class Controllers(BaseModel):
    """The controllers that are modelled."""

    controllers: list[ControllerInfo]


class OwnController(BaseModel):
    """The controller in a machine file, with the parameters in that file."""

    name: str
    parameters: dict[str, Any]


class MachineInfo(BaseModel):
    """A machine with defaults, kinds and units filled in."""

    name: str
    period: float
    chord_tolerance: float | None
    kinematics: str
    axes: list[Axis]
    controller: OwnController | None = Field(
        description="The controller of today, if the machine file names one"
    )
    file: str = Field(description="The text of its machine file (TOML)")


class Machines(BaseModel):
    """The bundled machines."""

    machines: list[MachineInfo]


class MethodInfo(BaseModel):
    """A planning method with its own options and their defaults."""

    name: str
    options: dict[str, Any]


class Methods(BaseModel):
    """The planning methods."""

    methods: list[MethodInfo]


class Health(BaseModel):
    """Whether the service works, and its limits."""

    status: Literal["ok"]
    version: str
    queued: int
    running: int
    limits: dict[str, dict[str, Any]]
