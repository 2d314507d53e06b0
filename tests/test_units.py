"""Numbers as text."""

from __future__ import annotations

import pytest

from feedplan.units import distance_text, duration_text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (842e-6, "842 µs"),
        (0.9996e-3, "1.0 ms"),
        (0.99999, "1.000 s"),
        (1.2344, "1.234 s"),
        (59.9996, "1 min 00.0 s"),
        (119.97, "2 min 00.0 s"),
        (723.4, "12 min 03.4 s"),
        (3599.97, "1 h 00 min 00 s"),
        (7199.7, "2 h 00 min 00 s"),
        (7510.0, "2 h 05 min 10 s"),
    ],
)
def test_a_duration_never_shows_sixty_seconds(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text


def test_a_distance_is_told_to_a_tenth_of_a_nanometre() -> None:
    assert distance_text(0.00939) == "9.39 µm"
    assert distance_text(1.4e-8) == "0 µm"
    assert distance_text(-1e-11, form="+.3g") == "+0 µm"
    assert distance_text(1.4e-8, "rad") == "1.4e-08 rad"
