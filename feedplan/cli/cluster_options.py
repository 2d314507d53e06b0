"""Options of the command line that name a Dask cluster and its certificates."""

from __future__ import annotations

import click

from feedplan.cli.options import as_one
from feedplan.jobs.address import ClusterAddress


def _address(
    cluster: str | None, tls_ca: str | None, tls_cert: str | None, tls_key: str | None
) -> ClusterAddress | None:
    if cluster is not None:
        return ClusterAddress.of(cluster, tls_ca, tls_cert, tls_key)
    if tls_ca or tls_cert or tls_key:
        raise click.UsageError("--tls-ca, --tls-cert and --tls-key are for a cluster: give --cluster too")
    return None


# The command gets these options as one argument, `cluster`, a ClusterAddress or None.
cluster_options = as_one(
    "cluster",
    _address,
    (
        click.option(
            "--cluster",
            metavar="ADDRESS",
            help="Scheduler of a Dask cluster that makes the plans: tcp://127.0.0.1:8786, or tls://planner:8786.",
        ),
        click.option(
            "--tls-ca", metavar="FILE", help="Certificate of the authority that signed the cluster's (PEM)."
        ),
        click.option("--tls-cert", metavar="FILE", help="This computer's certificate for the cluster (PEM)."),
        click.option("--tls-key", metavar="FILE", help="Private key of this certificate (PEM)."),
    ),
)
