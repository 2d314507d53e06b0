"""The end of a command: its exit code, and the sentence of an error.

0 done, 1 a limit is broken or no plan is feasible, 2 bad input or usage, 70 a defect in feedplan.
"""

from __future__ import annotations

import sys

from feedplan.errors import FeedplanError

DONE, BROKEN, BAD_INPUT, DEFECT, INTERRUPTED, PIPE_CLOSED = 0, 1, 2, 70, 130, 141


def fail(sentence: str, code: int) -> int:
    """Prints the sentence as an error; returns the code."""
    print(f"error: {FeedplanError(' '.join(sentence.split()))}", file=sys.stderr)
    return code
