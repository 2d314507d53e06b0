"""The connection to the scheduler of a Dask cluster."""

from __future__ import annotations

import logging
import socket
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

from feedplan.errors import InputError, MissingPackageError
from feedplan.jobs.address import ClusterAddress
from feedplan.jobs.identity import identity

# A class of distributed, which has no type hints.
Client = Any
Future = Any

# Longest time for the scheduler to answer, and for the client to close the connection [s].
CONNECTING, CLOSING = 10.0, 0.3


def connect(address: ClusterAddress) -> Client:
    """A client of Dask. Raises InputError if the scheduler cannot be reached, MissingPackageError without the
    package."""
    try:
        import dask
        import distributed
    except ModuleNotFoundError as error:
        raise MissingPackageError(
            f"a cluster needs the package {error.name}: `pip install feedplan[cluster]`"
        ) from None
    # Our own errors report broken connections, Ctrl-C needs no traceback, and large programs need no warning.
    for name in tuple(logging.root.manager.loggerDict):
        if name.startswith(("distributed", "tornado")):
            logging.getLogger(name).setLevel(logging.CRITICAL)
    dask.config.set({"distributed.admin.large-graph-warning-threshold": "1TB"})
    own = address.certificates
    secure: Any = distributed.Security
    security = own and secure(
        require_encryption=True,
        tls_ca_file=str(own.ca),
        tls_client_cert=str(own.cert),
        tls_client_key=str(own.key),
    )
    new_client: Any = distributed.Client
    parts = urlsplit(address.url)
    try:
        # Dask would repeat attempts for a long time if nothing listens at the address.
        socket.create_connection((parts.hostname, parts.port), CONNECTING).close()
        return new_client(
            address.url,
            security=security,
            timeout=CONNECTING,
            set_as_default=False,
            name="feedplan",
        )
    except (OSError, TimeoutError) as error:
        said = (getattr(error, "strerror", None) or str(error)).partition("\n")[0].rstrip(".:")
        raise InputError(
            f"the cluster at {address.url} cannot be reached ({said[:120].lower()}): "
            "start it by `dask scheduler`, or correct the address"
        ) from None


def close(client: Client) -> None:
    """Closes the connection within CLOSING; the scheduler drops the client's tasks."""
    with suppress(OSError, TimeoutError, AssertionError):  # the scheduler is lost
        client.close(timeout=CLOSING)


def require_equals(client: Client, address: ClusterAddress) -> None:
    """Raises InputError with the name of a worker whose feedplan differs from ours."""
    for worker, own in client.run(identity, on_error="return").items():
        if isinstance(own, Exception):
            own = f"none that can be used ({own})"
        if own != identity():
            raise InputError(
                f"the worker {worker} of the cluster at {address.url} has another feedplan, {own}: "
                f"install {identity()} there, plans would differ"
            )
