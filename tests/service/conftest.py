"""One server for the tests that do not change it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.service.servers import Server, running


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with running(tmp_path_factory.mktemp("store"), "--workers", "2") as found:
        yield found
