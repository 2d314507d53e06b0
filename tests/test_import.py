"""The package imports quickly and names what it promises."""

import feedplan


def test_every_public_name_exists() -> None:
    for name in feedplan.__all__:
        assert hasattr(feedplan, name)
