"""Makes the answers of the service from records and files: jobs, comparisons, machines, controllers."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path as FilePath
from typing import Any

from feedplan.comparison import LIMITS
from feedplan.machine.axis import Axis
from feedplan.machine.controller import Model
from feedplan.machine.machine import Machine
from feedplan.plan_folder import SUMMARY_FILE
from feedplan.service.refusals import STATE, Refusal
from feedplan.service.store import Record, Store
from feedplan.units import finite

_PARTS = ("events", "result", "audit", "setpoints", "program", "report", "drawing", "cancel")


def job(record: Record) -> dict[str, Any]:
    """A job as its clients see it."""
    address = f"/v1/jobs/{record['id']}"
    return {
        **{name: record[name] for name in ("id", "state", "created", "started", "finished", "method")},
        "program": {name: record[name] for name in ("name", "sha256", "bytes", "lines")},
        "machine": record["machine_name"],
        "options": json.loads(record["options"]),
        **{name: record[name] for name in ("stage", "done")},
        **{name: record[name] and json.loads(record[name]) for name in ("result", "problem")},
        "links": {"self": address, **{part: f"{address}/{part}" for part in _PARTS}},
    }


def done(store: Store, name: str) -> FilePath:
    """The folder of a job's plan. Raises Refusal with the reason if the job is not done."""
    record = store.job(name)
    if record["state"] == "done":
        return store.result(record)
    if record["problem"] is None:
        raise Refusal(STATE, f"the job is {record['state']}: wait for its end, /events tells it")
    problem = json.loads(record["problem"])
    place = {key: problem[key] for key in ("file", "line", "limit")}
    raise Refusal(STATE, problem["detail"], **place)


def summary(folder: FilePath) -> dict[str, Any]:
    """The content of plan.json."""
    table: dict[str, Any] = json.loads((folder / SUMMARY_FILE).read_text("utf-8"))
    return table


def compared(store: Store, name: str) -> dict[str, Any]:
    """A job as a row of a comparison. Raises Refusal for an unknown job."""
    record = store.job(name)
    row: dict[str, Any] = {
        "id": record["id"],
        "program": record["name"],
        "machine": record["machine_name"],
        "method": record["method"],
        "state": record["state"],
        **dict.fromkeys(("time", "lower_bound", "gap", "computing", "ok")),
        "worst": {},
        "error": json.loads(record["problem"])["detail"] if record["problem"] else None,
    }
    if record["state"] == "done":
        table = summary(store.result(record))
        row |= {name: table[name] for name in ("time", "lower_bound", "gap", "machine")}
        row |= {"computing": table["compute"].get("plan"), "ok": table["audit"]["ok"]}
        worst = {name: _worst(table["audit"].get(name)) for name in LIMITS}
        row["worst"] = {name: check for name, check in worst.items() if check is not None}
    return row


def _worst(checks: Any) -> dict[str, Any] | None:
    """The check of this name with the greatest use, over all axes."""
    if not isinstance(checks, dict):
        return None
    by_axis = {None: checks} if "ratio" in checks else checks
    known = [{"axis": axis, **check} for axis, check in by_axis.items() if check["ratio"] is not None]
    return max(known, key=lambda check: check["ratio"], default=None)


def machine(known: Machine) -> dict[str, Any]:
    """A machine with its limits and its whole file."""
    return {
        **{name: getattr(known, name) for name in ("name", "period", "kinematics")},
        "chord_tolerance": finite(known.chord_tolerance),
        "axes": [_axis(axis) for axis in known.axes],
        "controller": known.controller
        and {"name": known.controller.name, "parameters": dict(known.controller.parameters)},
        "file": known.to_toml(),
    }


def controller(name: str, model: Model) -> dict[str, Any]:
    """A controller with the method and the parameters of its model."""
    parameters = {key: asdict(own) for key, own in model.parameters.items()}
    return {"name": name, "method": model.method, "options": dict(model.options), "parameters": parameters}


def _axis(axis: Axis) -> dict[str, Any]:
    names = ("name", "kind", "unit", "max_velocity", "max_acceleration")
    travel = axis.travel if all(map(math.isfinite, axis.travel)) else None
    row = {name: getattr(axis, name) for name in names}
    return {**row, "max_jerk": finite(axis.max_jerk), "travel": travel}
