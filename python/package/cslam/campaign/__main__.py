"""``python -m cslam.campaign``: the shards of ``cslam campaign`` and ``cslam dataset`` on a Dask cluster."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

from cslam.campaign.cluster import Unreachable, connected
from cslam.campaign.merge import Differs, add_counts, put
from cslam.campaign.run import GivenUp, Refused, run_all
from cslam.campaign.shard import Outcome, Task, executable_crc

_DESCRIPTION = """\
Runs the shards of cslam campaign (one for each simulated flight) or cslam dataset (--shards of them) on a Dask cluster, and puts them
together in --out: the result is that of one process, bit for bit. Each shard takes one thread of a worker, unless ARGUMENTS say --threads.
The command must be on every worker, in the same build; so must this package. Names of files and of other directories than --out must mean the
same to every worker.
"""
_AFTERWARDS = """\
A shard whose worker is lost is run again on another one. A shard that loses more workers than the scheduler allows
(distributed.scheduler.allowed-failures, 3 unless told), or whose command fails, is run again --retries times. Arguments that the command refuses
end the run at once. What has arrived stays in --out; the same command flies what is missing of a campaign, and makes all of a data set again.

Exit codes: 0 all is there, 1 a shard was given up, 2 bad input, 130 interrupted.
"""


class _Wrong(Exception):
    """An argument that cannot be used, by its name."""


def _arguments(argv: list[str] | None) -> argparse.Namespace:
    whole = argparse.ArgumentParser(
        prog="python -m cslam.campaign",
        description=_DESCRIPTION,
        epilog=_AFTERWARDS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    where = whole.add_mutually_exclusive_group()
    where.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler, such as tcp://10.0.0.1:8786")
    where.add_argument("--workers", metavar="N", help="processes of a cluster on this machine (default: a processor each)")
    whole.add_argument("--retries", metavar="N", default="2", help="how often a shard that fails is run again (default: 2)")
    whole.add_argument("--command", metavar="FILE", default="cslam", help="the command (default: cslam, on the path)")
    whole.add_argument("-q", "--quiet", action="store_true", help="say nothing but results, warnings and errors")
    whole.add_argument("job", choices=["campaign", "dataset"], help="what to run")
    whole.add_argument("words", nargs=argparse.REMAINDER, metavar="ARGUMENTS", help="arguments of the command, --out DIR among them")
    return whole.parse_args(argv)


def _of_the_job(job: str, words: list[str]) -> argparse.Namespace:
    """The arguments of the command that count here too, and ``rest``."""
    known = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    known.add_argument("--out")
    known.add_argument("--json", action="store_true")
    if job == "dataset":
        known.add_argument("--shards", default="8")
    try:
        told, rest = known.parse_known_args(words)
    except argparse.ArgumentError as error:
        raise _Wrong(str(error)) from error
    if told.out is None:
        raise _Wrong("--out: expected a directory")
    for word in rest:
        option = word.split("=")[0]
        if option in ("--shard", "--missing", "--compare"):
            raise _Wrong(f"{option}: expected no such argument, shards are shared out here")
    if not any(word.split("=")[0] == "--threads" for word in rest):
        rest += ["--threads", "1"]
    told.rest = rest
    return told


def _number(name: str, text: str, least: int, most: int) -> int:
    if not (text.isascii() and text.isdigit() and least <= int(text) <= most):
        raise _Wrong(f"{name} {text}: expected a whole number, {least} to {most}")
    return int(text)


def _run(told: argparse.Namespace) -> None:
    own = _of_the_job(told.job, told.words)
    retries = _number("--retries", told.retries, 0, 100)
    workers = os.cpu_count() or 1 if told.workers is None else _number("--workers", told.workers, 1, 1000)
    command = os.path.abspath(told.command) if os.path.dirname(told.command) else told.command
    if shutil.which(command) is None:
        raise _Wrong(f"--command {told.command}: expected the cslam command (cargo install --path host-sim)")
    out = Path(own.out)
    words = (told.job, *own.rest)

    def not_there() -> tuple[int, list[int]]:
        told = json.loads(_printed([command, *words, "--out", own.out, "--missing"]))
        return told["shards"], told["missing"]

    # What is wrong is said in the words of the command, before anything is begun.
    if told.job == "campaign":
        shards, missing = not_there()
        shared = None
    else:
        shards = _number("--shards", own.shards, 1, 9999)
        missing, shared, words = list(range(shards)), "dataset.json", (*words, "--json")
    counts: dict[str, int] = {}

    def arrived(outcome: Outcome) -> None:
        nonlocal counts
        put(out, outcome.files, shared)
        if told.job == "dataset":
            counts = add_counts(counts, json.loads(outcome.printed))

    def say(text: str) -> None:
        if not told.quiet:
            print(text, file=sys.stderr)

    if missing:
        with connected(told.scheduler, workers) as client:
            threads = client.nthreads()
            say(f"{len(missing)} shards on {len(threads)} workers, {sum(threads.values())} at a time")
            task = Task(command, executable_crc(command), words, os.getcwd())
            run_all(client, task, missing, shards, retries, arrived, say)
    if told.job == "dataset":
        print(json.dumps(counts, separators=(",", ":")))
        return
    _, missing = not_there()
    if missing:
        raise GivenUp("\n".join(f"shard {shard}/{shards}: left no flight" for shard in missing))
    # What is left is the summary.
    summary = [command, *words, "--out", own.out, *(["--json"] if own.json else [])]
    print(_printed(summary), end="")


def _printed(command: list[str]) -> str:
    """What the command prints.

    Raises
    ------
    Refused
        With what it says, when it ends in any other way.
    """
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    if ended.returncode != 0:
        raise Refused(ended.stderr.strip() or f"{command[0]}: exit code {ended.returncode}")
    return ended.stdout


def main(argv: list[str] | None = None) -> int:
    """The exit code."""
    told = _arguments(argv)
    try:
        _run(told)
    except (_Wrong, Refused, Unreachable, Differs) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except GivenUp as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted: what has arrived stays", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
