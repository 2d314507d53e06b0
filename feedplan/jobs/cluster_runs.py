"""Plans the runs of one program, which are independent of each other, on the workers of a Dask cluster.

`feedplan.plan(..., elsewhere=ClusterRuns(address))` sends the runs between stops in parts, a few for each
thread, and joins the results to the plan that this computer would make, bit for bit.
"""

from __future__ import annotations

import secrets
import threading
from collections.abc import Callable, Sequence
from typing import Any

from feedplan.errors import FeedplanError, SolverError
from feedplan.jobs.address import ClusterAddress
from feedplan.jobs.cluster_task import other_feedplan, require_wanted
from feedplan.jobs.connection import close, connect, require_equals
from feedplan.jobs.identity import identity
from feedplan.progress import Listener, tell

# Time between two reports of progress, which may end the work [s].
EVERY = 0.1
# Parts for each thread: several, because the parts take different times.
PARTS = 4


class ClusterRuns:
    """The workers of a cluster, which plan parts of a program.

    Raises InputError if the cluster cannot be reached or has another feedplan, MissingPackageError without
    the package.
    """

    def __init__(self, address: ClusterAddress) -> None:
        self._client = connect(address)
        try:
            require_equals(self._client, address)
        except FeedplanError:
            self.close()
            raise

    def __enter__(self) -> ClusterRuns:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the connection."""
        close(self._client)

    def count(self) -> int:
        """The number of parts that keeps all threads busy."""
        threads: int = sum(self._client.nthreads().values())
        return PARTS * max(threads, 1)

    def map(
        self, work: Callable[..., Any], given: Sequence[tuple[Any, ...]], progress: Listener | None
    ) -> list[Any]:
        """The results of `work(*arguments, progress)` for each of the arguments, computed on the workers.

        Raises SolverError if the cluster fails, and the exceptions of `progress`.
        """
        task = f"feedplan-{secrets.token_hex(8)}"
        changed = threading.Event()
        futures: list[Any] = []
        try:
            for number, arguments in enumerate(given):
                name = f"{task}-{number}"
                futures.append(
                    self._client.submit(run_part, name, identity(), work, arguments, key=name, pure=False)
                )
                futures[-1].add_done_callback(lambda _: changed.set())
            while (done := sum(future.done() for future in futures)) < len(futures):
                tell(progress, done / len(futures))
                changed.wait(EVERY)
                changed.clear()
            return [_result(future) for future in futures]
        finally:
            self._client.cancel([future for future in futures if not future.done()])


def _result(future: Any) -> Any:
    from distributed import CancelledError, KilledWorker

    try:
        result, sentence = future.result()
    except (KilledWorker, CancelledError, OSError) as error:
        raise SolverError(
            f"the cluster has lost a part of the plan ({type(error).__name__}): "
            "give its workers more memory, or leave the cluster out"
        ) from None
    if sentence is not None:
        raise SolverError(sentence)
    return result


def run_part(
    name: str, expected: str, work: Callable[..., Any], arguments: tuple[Any, ...]
) -> tuple[Any, str | None]:
    """Runs in a worker: returns the result, or a sentence that tells why there is none."""
    from distributed import get_worker

    worker = get_worker()
    if (sentence := other_feedplan(worker, expected)) is not None:
        return None, sentence
    return work(*arguments, lambda _: require_wanted(worker, name)), None
