"""Starts the service: checks its address and token, and runs uvicorn."""

from __future__ import annotations

import logging
import socket
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path as FilePath

import uvicorn

from feedplan.client.token import read_token
from feedplan.errors import InputError
from feedplan.jobs.address import ClusterAddress, is_address, is_loopback
from feedplan.jobs.executor import Executor, JobLimits
from feedplan.jobs.processes import Processes
from feedplan.service.app import create
from feedplan.service.guard import Guard
from feedplan.service.limits import Limits

# Time for answers to finish when the service is told to end [s].
ENDING = 3


def serve(
    host: str,
    port: int,
    store: FilePath,
    token_file: FilePath | None,
    allowed_hosts: Sequence[str],
    limits: Limits,
    cluster: ClusterAddress | None,
    ready: Callable[[str], None],
) -> None:
    """Runs the service until a signal ends it; its jobs run on a cluster, or in processes of this computer.

    `ready(address)` is called when the service can be reached. Raises InputError if the address needs a token
    or cannot be used, and if the token, the store or the cluster cannot be used.
    """
    token = None if token_file is None else read_token(token_file)
    if token is None and not is_loopback(host):
        raise InputError(
            f"{host} can be reached from other computers and the service has no token: "
            "give --token-file FILE, or --host 127.0.0.1"
        )
    # Errors in a form go to its sender, not to the log.
    logging.getLogger("python_multipart").setLevel(logging.CRITICAL)
    bound = _bound(host, port)
    with bound:
        app = create(store, limits, _executor(cluster, limits))
        names = {"localhost", socket.gethostname(), *allowed_hosts, *([] if is_address(host) else [host])}
        config = uvicorn.Config(
            Guard(app, limits, names, token),
            loop="asyncio",
            http="h11",
            ws="none",
            lifespan="on",
            log_level="error",
            access_log=False,
            server_header=False,
            proxy_headers=False,
            timeout_graceful_shutdown=ENDING,
        )
        shown = f"[{host}]" if ":" in host else host
        ready(f"http://{shown}:{bound.getsockname()[1]}")
        with suppress(KeyboardInterrupt):  # Ctrl-C ends the service
            uvicorn.Server(config).run(sockets=[bound])


def _executor(cluster: ClusterAddress | None, limits: Limits) -> Executor:
    of_jobs = JobLimits(limits.max_time, limits.max_memory)
    if cluster is None:
        return Processes(limits.workers, of_jobs)
    from feedplan.jobs.cluster import Cluster

    return Cluster(cluster, of_jobs)


def _bound(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        bound = socket.create_server((host, port), family=family)
        # Connections inherit this option. asyncio sets it only for sockets that name their protocol. Without
        # it the second part of an answer on a kept connection waits 40 ms for the client's acknowledgement of
        # the first.
        bound.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return bound
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"the service cannot listen on {host}, port {port} ({reason}): "
            "choose others with --host and --port"
        ) from None
