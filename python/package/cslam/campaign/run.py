"""Shards handed out, tried again, and put together as they arrive.

What happens to a shard that fails:

- A worker is lost: the scheduler runs again what that one had, on others. A shard fails when it has lost more workers than the scheduler's
  ``distributed.scheduler.allowed-failures``.
- A shard fails in that way, or because the command fails, is not there or is another build on that worker: it is run again, ``retries`` times.
- The command refuses its arguments (exit code 2): it would do so anywhere, and the run ends.

A shard that was given up does not keep the others from being run. What has arrived stays.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable
from typing import TYPE_CHECKING

from cslam.campaign.shard import Outcome, Task, run

if TYPE_CHECKING:
    from distributed import Client, Future

#: Exit code of the command for bad input.
REFUSED = 2


class Refused(Exception):
    """The command refuses its arguments; in its own words."""


class GivenUp(Exception):
    """Shards that could not be run, a line each."""


def run_all(
    client: Client,
    task: Task,
    missing: list[int],
    shards: int,
    retries: int,
    arrived: Callable[[Outcome], None],
    say: Callable[[str], None],
) -> None:
    """Runs the shards ``missing`` of ``shards``, and hands each outcome to ``arrived`` once.

    Raises
    ------
    Refused
        When the command refuses its arguments; no other shard is begun then.
    GivenUp
        When all the others have arrived, naming those that failed and how.
    """
    from distributed import as_completed

    # Tasks of one name are a group, of which the scheduler hands out no more than workers have threads for. What waits on a worker would be
    # lost with it.
    name = f"cslam-shard-{uuid.uuid4().hex[:8]}"
    count, done, given_up = len(missing), 0, []
    constant = ([task] * count, missing, [shards] * count)
    completed = as_completed(client.map(run, *constant, key=[(name, shard, 0) for shard in missing], pure=False))
    for future in completed:
        _, shard, attempt = future.key
        failure, again = _failure(future)
        if failure is None:
            arrived(future.result())
            done += 1
            say(f"shard {shard}/{shards}: done, {done} of {count}")
        elif again and attempt < retries:
            say(f"shard {shard}/{shards}: {failure}: tried again ({attempt + 1} of {retries})")
            completed.add(client.submit(run, task, shard, shards, key=(name, shard, attempt + 1), pure=False))
        else:
            given_up.append(f"shard {shard}/{shards}: {failure}")
            say(f"{given_up[-1]}: given up after {attempt + 1} attempts" if again else f"{given_up[-1]}: given up")
        future.release()
    if given_up:
        raise GivenUp("\n".join(given_up))


def _failure(future: Future) -> tuple[str | None, bool]:
    """Why a shard failed, or None; and whether it may be tried again.

    Raises
    ------
    Refused
        When the command refused its arguments.
    """
    from distributed import KilledWorker

    if future.status == "finished":
        outcome = future.result()
        if outcome.exit_code == 0:
            return None, False
        if outcome.exit_code == REFUSED:
            raise Refused(outcome.said)
        return f"exit code {outcome.exit_code}: {outcome.said}", True
    if future.status == "error":
        error = future.exception()
        if isinstance(error, KilledWorker):
            return f"its workers were lost, the last at {error.last_worker.address}", True
        return f"{type(error).__name__}: {error}", True
    return "the scheduler is gone", False
