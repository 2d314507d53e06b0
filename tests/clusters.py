"""Dask clusters on this computer as users start them: one process for the scheduler and for each worker."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

# A worker that gets a program of this name is killed, as if it had run out of memory.
DEADLY = "deadly.ngc"
# A worker that gets a program of this name waits in its reader until `LocalCluster.release`.
HELD = "held.ngc"
_RELEASED = "released"
_PRELOAD = f"""
import os, signal, time
from feedplan.jobs import cluster_task
from feedplan.jobs.work import work_on
def work_or_end(job, progress):
    if job.order.name == {DEADLY!r}:
        os.kill(os.getpid(), signal.SIGKILL)
    while job.order.name == {HELD!r} and not os.path.exists({_RELEASED!r}):
        progress("read", 0.0)
        time.sleep(0.05)
    return work_on(job, progress)
cluster_task.work_on = work_or_end
"""


class LocalCluster:
    """A scheduler and workers with one thread each; `options` connect the command `feedplan` to it."""

    def __init__(
        self, folder: Path, workers: int, certificates: Path | None = None, **variables: str
    ) -> None:
        self.folder, self._certificates = folder, certificates
        folder.mkdir(exist_ok=True)
        (folder / "preload.py").write_text(_PRELOAD)
        self._environment = {
            **os.environ,
            "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1",
            "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
            # By default it measures its delays every 20 ms, which takes 6 % of a processor for two workers.
            "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
            **variables,
        }
        scheme = "tcp" if certificates is None else "tls"
        self._port = _free_port()
        self.url = f"{scheme}://127.0.0.1:{self._port}"
        self._workers: list[subprocess.Popen[bytes]] = []
        self.start_scheduler()
        for _ in range(workers):
            self.start_worker()

    @property
    def options(self) -> list[str]:
        """The options of the command `feedplan` for this cluster."""
        return ["--cluster", self.url, *self._tls]

    @property
    def _tls(self) -> list[str]:
        if self._certificates is None:
            return []
        names = {"--tls-ca": "ca.pem", "--tls-cert": "cert.pem", "--tls-key": "key.pem"}
        return [word for name, file in names.items() for word in (name, str(self._certificates / file))]

    def _start(self, name: str, *arguments: str, **variables: str) -> subprocess.Popen[bytes]:
        options = [word.replace("--tls-ca", "--tls-ca-file") for word in self._tls]
        with (self.folder / f"{name}.log").open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "dask", name, *arguments, *options, "--no-dashboard"],
                env={**self._environment, **variables},
                cwd=self.folder,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    def start_scheduler(self) -> None:
        """Starts the scheduler, perhaps again, and waits until it can be reached."""
        scheme = self.url.partition(":")[0]
        where = ["--host", "127.0.0.1", "--port", str(self._port), "--protocol", scheme]
        self.scheduler = self._start("scheduler", *where)
        end = time.monotonic() + 20.0
        while time.monotonic() < end:
            with suppress(OSError), socket.create_connection(("127.0.0.1", self._port), timeout=1.0):
                return
            time.sleep(0.05)
        raise AssertionError((self.folder / "scheduler.log").read_text())

    def start_worker(self, **variables: str) -> None:
        """Adds a worker, which is restarted when it is killed; its environment gets `variables`."""
        own = ["--nthreads", "1", "--nworkers", "1", "--preload", str(self.folder / "preload.py")]
        own += ["--local-directory", str(self.folder)]
        self._workers.append(self._start("worker", self.url, *own, **variables))

    def release(self) -> None:
        """Lets the workers continue with the programs that they hold."""
        (self.folder / _RELEASED).touch()

    def kill_a_worker(self) -> None:
        """Kills (kill -9) a worker that has work."""
        with self.client() as client:
            found = client.run(lambda dask_worker: (len(dask_worker.state.tasks), os.getpid()))
        count, process = max(found.values())
        assert count
        os.kill(process, signal.SIGKILL)

    def kill_scheduler(self) -> None:
        self.scheduler.kill()
        self.scheduler.wait()

    def client(self) -> Any:
        """A client of Dask."""
        import distributed

        own = self._certificates
        security = own and distributed.Security(
            tls_ca_file=str(own / "ca.pem"),
            tls_client_cert=str(own / "cert.pem"),
            tls_client_key=str(own / "key.pem"),
            require_encryption=True,
        )
        return distributed.Client(self.url, security=security, set_as_default=False, timeout=20)

    def wait_for(self, workers: int) -> None:
        """Waits for this many workers."""
        with self.client() as client:
            client.wait_for_workers(workers, timeout=30)

    def wait_until_idle(self) -> None:
        """Waits until no worker has work."""
        with self.client() as client:
            end = time.monotonic() + 20.0
            while time.monotonic() < end:
                states = client.run(lambda dask_worker: len(dask_worker.state.tasks))
                if not any(states.values()) and not any(client.processing().values()):
                    return
                time.sleep(0.05)
        raise AssertionError(f"the workers have tasks: {states}")

    def end(self) -> None:
        for process in (*self._workers, self.scheduler):
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


@contextmanager
def running(folder: Path, workers: int, **more: Any) -> Iterator[LocalCluster]:
    """A cluster with `workers` workers."""
    cluster = LocalCluster(folder, workers, **more)
    try:
        cluster.wait_for(workers)
        yield cluster
    finally:
        cluster.end()


def make_certificates(folder: Path) -> Path:
    """A folder with an authority's certificate, and one certificate with its key for the whole cluster."""
    folder.mkdir()
    request = [
        "openssl",
        "req",
        "-x509",
        "-newkey",
        "ec",
        "-pkeyopt",
        "ec_paramgen_curve:prime256v1",
        "-nodes",
    ]
    ca = ["-subj", "/CN=authority", "-days", "2", "-keyout", "ca.key", "-out", "ca.pem"]
    own = ["-subj", "/CN=cluster", "-days", "2", "-keyout", "key.pem", "-out", "cert.pem"]
    signed = ["-CA", "ca.pem", "-CAkey", "ca.key", "-addext", "basicConstraints=critical,CA:FALSE"]
    for arguments in (ca, [*own, *signed]):
        subprocess.run([*request, *arguments], cwd=folder, check=True, capture_output=True)
    return folder


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as bound:
        return int(bound.getsockname()[1])
