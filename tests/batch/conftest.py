"""One cluster for the tests that do not change it: two workers, with TLS."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.clusters import LocalCluster, make_certificates, running


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LocalCluster]:
    home = tmp_path_factory.mktemp("cluster")
    with running(home, 2, certificates=make_certificates(home / "certificates")) as found:
        yield found
