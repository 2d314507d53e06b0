"""The number of random cases of a test: its own number, always the same cases, or more in a campaign.

FEEDPLAN_SEEDS is the number of seeds of a test with seeds; FEEDPLAN_EXAMPLES is the number of new examples of
a property test for each 100 of its usual ones.
"""

from __future__ import annotations

import os

SEEDS = os.environ.get("FEEDPLAN_SEEDS")
EXAMPLES = os.environ.get("FEEDPLAN_EXAMPLES")


def seeds(count: int) -> int:
    """The number of seeds, from 0 on."""
    return int(SEEDS or count)


def examples(count: int) -> int:
    """The number of examples."""
    return count * int(EXAMPLES or 100) // 100
