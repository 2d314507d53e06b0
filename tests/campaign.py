"""The number of random cases of a test: a fixed number with fixed seeds, or more cases in a campaign.

FEEDPLAN_SEEDS replaces the number of seeds of a test. FEEDPLAN_EXAMPLES is the number of new examples of a
property test, in percent of its usual number.
"""

from __future__ import annotations

import os

SEEDS = os.environ.get("FEEDPLAN_SEEDS")
EXAMPLES = os.environ.get("FEEDPLAN_EXAMPLES")


def seeds(count: int) -> int:
    """The number of seeds of a test; the seeds are 0, 1, 2, …"""
    return int(SEEDS or count)


def examples(count: int) -> int:
    """The number of examples of a property test."""
    return count * int(EXAMPLES or 100) // 100
