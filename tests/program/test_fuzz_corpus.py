"""Inputs found by coverage-guided fuzzing of the reader, and mutations of them: each is read or refused."""

from __future__ import annotations

import tarfile
from pathlib import Path

import numpy as np
import pytest

from feedplan import Machine
from feedplan.errors import LONGEST, FeedplanError
from feedplan.program.read import read_program
from tests.hostile import mutated

CORPUS = Path(__file__).parents[2] / "solvers" / "fuzz" / "corpus.tar.xz"
# Greatest number of moves of a program with loops; number of mutations of each input.
MOVES, MUTATIONS = 10_000, 2


@pytest.fixture(scope="module")
def corpus() -> list[bytes]:
    with tarfile.open(CORPUS) as archive:
        files = [archive.extractfile(member) for member in archive if member.isfile()]
        return [file.read() for file in files if file is not None]


def wrong(text: bytes, machine: Machine) -> str:
    """What is wrong with the outcome of reading; empty if nothing is."""
    try:
        program = read_program(text, machine, max_moves=MOVES)
    except FeedplanError as refusal:
        return "" if len(str(refusal)) <= LONGEST else f"a refusal of {len(str(refusal))} letters"
    except BaseException as defect:  # a panic of native code is no subclass of Exception
        return f"{type(defect).__name__}: {defect}"
    return "" if np.isfinite(program.target).all() else "a move to no place"


def test_each_input_and_mutations_of_it_are_read_or_refused(corpus: list[bytes]) -> None:
    assert len(corpus) > 2000
    machine = Machine.load("mill")
    found = []
    for number, text in enumerate(corpus):
        changed = (mutated(text, MUTATIONS * number + k) for k in range(MUTATIONS))
        found += [(case, said) for case in (text, *changed) if (said := wrong(case, machine))]
    assert found == []
