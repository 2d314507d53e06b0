"""`feedplan serve`: starts the service; each of its limits has an option of the same name."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import Field, fields
from pathlib import Path as FilePath
from typing import Any

import click

from feedplan.cli.cluster_options import cluster_options
from feedplan.cli.options import Place, as_one
from feedplan.errors import MissingPackageError
from feedplan.jobs.address import ClusterAddress
from feedplan.service.limits import Limits

TOKEN_FILE = click.option(
    "--token-file",
    metavar="FILE",
    envvar="FEEDPLAN_TOKEN_FILE",
    help="File with the service's token on one line.",
)


def _limit_option(own: Field[Any]) -> Callable[..., Any]:
    kind = click.IntRange if isinstance(own.default, int) else click.FloatRange
    return click.option(
        f"--{own.name.replace('_', '-')}",
        type=kind(min=own.metadata["least"]),
        default=own.default,
        show_default=True,
        metavar=own.metadata["unit"].upper(),
        help=own.metadata["help"],
    )


# The command gets these options as one argument, `limits`.
limit_options = as_one("limits", Limits, [_limit_option(own) for own in fields(Limits)])


@click.command()
@click.option(
    "--host", default="127.0.0.1", show_default=True, metavar="ADDRESS", help="Address to listen at."
)
@click.option(
    "--port",
    type=click.IntRange(0, 65_535),
    default=8000,
    show_default=True,
    help="Port to listen at; 0: any free one.",
)
@click.option(
    "--store",
    type=Place(),
    default="feedplan-jobs",
    show_default=True,
    metavar="DIR",
    help="Folder for the jobs.",
)
@TOKEN_FILE
@click.option(
    "--allow-host",
    "allowed",
    multiple=True,
    metavar="NAME",
    help="Another host name by which clients reach the service.",
)
@cluster_options
@limit_options
def serve(
    host: str,
    port: int,
    store: str,
    token_file: str | None,
    allowed: tuple[str, ...],
    limits: Limits,
    cluster: ClusterAddress | None,
) -> None:
    """Plan jobs of clients over HTTP; the address /docs of the service describes the requests.

    A service that other computers can reach needs --token-file. It prints its address when it is ready.
    With --cluster jobs run on the workers of a Dask cluster, as many at a time as the workers have threads.
    """
    try:
        from feedplan.service.server import serve as run
    except ModuleNotFoundError as error:
        raise MissingPackageError(
            f"the service needs the package {error.name}: `pip install feedplan[serve]`"
        ) from None
    token = None if token_file is None else FilePath(token_file)
    ready = functools.partial(print, flush=True)
    run(host, port, FilePath(store), token, allowed, limits, cluster, ready)
