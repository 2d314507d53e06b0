"""How many random cases a test takes: its own number of them, always the same ones, or more in a campaign.

FEEDPLAN_SEEDS is how many seeds a test goes through that draws by seeds; FEEDPLAN_EXAMPLES is how many new
examples a property test draws for each 100 that it draws otherwise.
"""

from __future__ import annotations

import os

SEEDS = os.environ.get("FEEDPLAN_SEEDS")
EXAMPLES = os.environ.get("FEEDPLAN_EXAMPLES")


def seeds(count: int) -> int:
    """How many seeds, from 0 on."""
    return int(SEEDS or count)


def examples(count: int) -> int:
    """How many examples."""
    return count * int(EXAMPLES or 100) // 100
