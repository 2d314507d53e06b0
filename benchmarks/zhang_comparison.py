"""What the optimum on fitted splines gains over transitions at corners: Zhang et al. 2010, section 5."""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.named import example
from benchmarks.results import Cell, Result
from feedplan import Machine, Plan, Program, plan
from feedplan.program.read import read_program

NAME = "zhang-comparison"
# The parts of the paper's figure 8 as our examples have them, and their blocks.
PARTS = {"vase": 20_000, "lettering": 10_000, "head": 20_000}
QUICK = 20  # times fewer blocks
# The paper states the accelerations (section 4.3), neither the period nor the feed: 1 to 4 ms were usual.
MACHINE = "vase"
PERIODS = (0.001, 0.002, 0.004)  # [s]
OPTIMUM, TRANSITIONS = "bang-bang", ("constant-velocity-transition", "arc-transition")
GAINS = {"constant-velocity-transition": "65 to 130 %", "arc-transition": "30 to 110 %"}


def run(quick: bool = False) -> Result:
    """Plan every part by the three methods at each period, and audit what is planned."""
    rows: list[dict[str, Cell]] = []
    with tempfile.TemporaryDirectory() as directory:
        for part, blocks in PARTS.items():
            file = Path(directory, f"{part}.ngc")
            file.write_text(example(part).program(blocks // (QUICK if quick else 1)), encoding="ascii")
            program = read_program(file, Machine.load(MACHINE))
            rows += [_row(part, program, period) for period in PERIODS]
    return Result(
        NAME,
        "Machining time over the optimum's",
        tuple(rows),
        (
            "gain: the method's time over that of bang-bang on fitted splines, less 1.",
            "The paper reports " + ", ".join(f"{gain} over {method}" for method, gain in GAINS.items()) + ".",
        ),
    )


def _row(part: str, program: Program, period: float) -> dict[str, Cell]:
    optimum = _planned(program, OPTIMUM, period)
    row: dict[str, Cell] = {
        "part": part,
        "moves": len(program),
        "period [ms]": 1e3 * period,
        "optimum [s]": optimum.time,
    }
    audits = [optimum.audit().ok]
    for method in TRANSITIONS:
        other = _planned(program, method, period)
        row[f"{method} [s]"] = other.time
        row[f"{method} gain [%]"] = 100.0 * (other.time / optimum.time - 1.0)
        audits.append(other.audit().ok)
    row["audits"] = "ok" if all(audits) else "broken"
    return row


def _planned(program: Program, method: str, period: float) -> Plan:
    return plan(program, Machine.load(MACHINE), method, period=period)
