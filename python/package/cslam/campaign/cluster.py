"""A connection to a Dask scheduler: the one that was named, or one of a cluster of its own."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Iterator

if TYPE_CHECKING:
    from distributed import Client

#: How long a scheduler that was named may take to answer, s.
ANSWER_S = 20


class Unreachable(Exception):
    """There is no scheduler to work with."""


@contextlib.contextmanager
def connected(scheduler: str | None, workers: int) -> Iterator[Client]:
    """A client of the scheduler at an address; None: of a cluster of ``workers`` processes on this machine, reachable from it alone, which ends
    with the client.

    Raises
    ------
    Unreachable
        When Dask is not installed, or nothing answers at the address.
    """
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise Unreachable(f"Dask is not installed ({error}): expected the extra campaign (pip install './python[campaign]' in a clone)") from error
    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=ANSWER_S)
        except (OSError, ValueError, TimeoutError) as error:
            raise Unreachable(f"--scheduler {scheduler}: expected the address of a Dask scheduler: {error}") from error
        with client:
            yield client
        return
    # A worker gets a shard when it has a thread for it.
    with dask.config.set({"distributed.scheduler.worker-saturation": 1.0}):
        cluster = LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            # The command takes the memory, in a process of its own.
            memory_limit=0,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
        )
        with cluster, Client(cluster) as client:
            yield client
