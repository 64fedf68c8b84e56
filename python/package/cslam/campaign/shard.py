"""One shard, as a worker runs it: the command in a directory of its own, and what it left there."""

from __future__ import annotations

import dataclasses
import os
import platform
import shutil
import subprocess
import tempfile
import zlib
from pathlib import Path


@dataclasses.dataclass(frozen=True)
class Task:
    """What every shard of a run has in common."""

    #: The command: a name on the path, or a file that every worker has at the same place.
    command: str
    #: CRC-32 of its executable: results of two builds are not one result.
    command_crc: int
    #: ``campaign`` or ``dataset``, and its arguments but those of the shard.
    words: tuple[str, ...]
    #: Where it was asked for, which names of files are relative to.
    directory: str


@dataclasses.dataclass(frozen=True)
class Outcome:
    """How the command ended."""

    #: As the command gives it; negative: the signal that ended it.
    exit_code: int
    #: What it left by its name below ``--out``; empty when it failed.
    files: dict[str, bytes]
    #: What it printed.
    printed: str
    #: The last line that it said on standard error.
    said: str


def executable_crc(command: str) -> int:
    """CRC-32 of the command's executable.

    Raises
    ------
    FileNotFoundError
        Naming the command when there is none.
    """
    found = shutil.which(command)
    if found is None:
        raise FileNotFoundError(f"{command}: no such program")
    return zlib.crc32(Path(found).read_bytes())


def run(task: Task, shard: int, shards: int) -> Outcome:
    """Runs a shard, ``shard`` of ``shards``, counted from 0.

    Raises
    ------
    OSError
        When the command is not there, or is another build than that of whoever asked.
    """
    if executable_crc(task.command) != task.command_crc:
        raise OSError(f"{task.command} on {platform.node()} is another build")
    with tempfile.TemporaryDirectory(prefix="cslam-shard-", dir=_own_directory()) as temporary:
        out = Path(temporary) / "out"
        ended = subprocess.run(
            [task.command, "--quiet", *task.words, "--out", str(out), "--shard", f"{shard}/{shards}"],
            cwd=task.directory if os.path.isdir(task.directory) else None,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        said = ended.stderr.strip().splitlines()
        whole = ended.returncode == 0
        left = [file for file in out.rglob("*") if file.is_file()] if whole else []
        return Outcome(
            exit_code=ended.returncode,
            files={file.relative_to(out).as_posix(): file.read_bytes() for file in sorted(left)},
            printed=ended.stdout,
            said=said[-1] if said else "",
        )


def _own_directory() -> str | None:
    """The worker's directory, which Dask clears when a worker was lost; None outside of a worker."""
    from distributed import get_worker

    try:
        return get_worker().local_directory
    except ValueError:
        return None
