"""Results of shards put together.

A campaign is the set of its flights' files, a data set that of its shards and the sum of their counts. Both are associative and commutative:
in whatever order shards arrive, and whoever ran them, the result is that of one process.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path


class Differs(Exception):
    """A shard is not of what lies in the directory already."""


def add_counts(a: dict[str, int], b: dict[str, int]) -> dict[str, int]:
    """Sums of what two parts of a data set count, by name."""
    return {name: a.get(name, 0) + b.get(name, 0) for name in [*a, *(name for name in b if name not in a)]}


def put(out: Path, files: dict[str, bytes], common: str | None) -> None:
    """Puts the files of a shard into a directory: each file, and each directory in it, is there whole or not at all.

    ``common``: a file that all shards have, with the same bytes.

    Raises
    ------
    Differs
        When the common file is another one: nothing was put.
    OSError
        When a file cannot be written.
    """
    out.mkdir(parents=True, exist_ok=True)
    if common is not None:
        place = out / common
        if place.exists() and place.read_bytes() != files[common]:
            raise Differs(f"{place}: describes another data set: choose another directory")
    for top in sorted({name.split("/")[0] for name in files}):
        place, part = out / top, out / f"{top}.part"
        if top in files:
            part.write_bytes(files[top])
        else:
            shutil.rmtree(part, ignore_errors=True)
            for name in (name for name in files if name.startswith(f"{top}/")):
                file = part / name[len(top) + 1 :]
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_bytes(files[name])
            shutil.rmtree(place, ignore_errors=True)
        os.replace(part, place)
