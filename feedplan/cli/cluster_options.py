"""Options of the command line that name a Dask cluster and its certificates."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

import click

from feedplan.cli.options import with_options
from feedplan.jobs.address import ClusterAddress

Command = TypeVar("Command", bound=Callable[..., Any])

_OPTIONS = (
    click.option(
        "--cluster",
        metavar="ADDRESS",
        help="The scheduler of a Dask cluster that plans, as tcp://127.0.0.1:8786, or tls://planner:8786.",
    ),
    click.option("--tls-ca", metavar="FILE", help="Certificate that has signed those of the cluster (PEM)."),
    click.option("--tls-cert", metavar="FILE", help="Our certificate for the cluster (PEM)."),
    click.option("--tls-key", metavar="FILE", help="The key of our certificate (PEM)."),
)


def cluster_options(command: Command) -> Command:
    """Adds the options; the command gets them as one argument, `cluster`, a ClusterAddress or None."""

    @functools.wraps(command)
    def packed(
        *args: Any,
        cluster: str | None,
        tls_ca: str | None,
        tls_cert: str | None,
        tls_key: str | None,
        **others: Any,
    ) -> Any:
        if cluster is None and (tls_ca or tls_cert or tls_key):
            raise click.UsageError("--tls-ca, --tls-cert and --tls-key are for a cluster: give --cluster too")
        address = None if cluster is None else ClusterAddress.of(cluster, tls_ca, tls_cert, tls_key)
        return command(*args, cluster=address, **others)

    return with_options(packed, _OPTIONS)  # type: ignore[no-any-return]
