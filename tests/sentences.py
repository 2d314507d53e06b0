"""What a command says where it fails."""

from __future__ import annotations


def assert_one_sentence(err: str, words: str) -> None:
    """The text of the error is one line, with these words in it."""
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert words in err
