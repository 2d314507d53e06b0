"""Checks of the messages of commands."""

from __future__ import annotations


def assert_one_sentence(err: str, words: str) -> None:
    """Asserts that the error output is one line that contains `words`."""
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert words in err
