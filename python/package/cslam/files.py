"""Files: samples as SigMF, path lists, packets, flights."""

from __future__ import annotations

import dataclasses
import json
import os
import tempfile
from pathlib import Path
from typing import Any, Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cslam import _cslam
from cslam._shapes import Floats, dense, floats, integers
from cslam.world import Link



@dataclasses.dataclass(frozen=True)
class Recording:
    """A sweep of ``b`` beams as the front end hands it over."""

    #: ``[b, 32, 512, 2]``, int16: beam, channel, sample, I and Q.
    iq: NDArray[np.int16]
    #: ``[b]``, uint16.
    beams: NDArray[np.uint16]
    #: ``[b]``, int32, **one for each beam**: amplitude = integer x 2^exponent.
    exponents: NDArray[np.int32]
    #: What was sent: ``gmt-72``; or ``gmt-72-pilots`` for pilots, ``bsm-seq``, ``bsm-raster`` for beam squint symbols, of which no paths are estimated.
    codebook: str = "gmt-72"
    #: ``[3]``, world axes, m, or None.
    gmt_position_m: Floats | None = None
    #: ``[3]``, world axes, m, or None.
    uav_position_m: Floats | None = None
    #: ``[4]``, or None.
    uav_quaternion_wb: Floats | None = None
    #: The radio, in the form of the configuration's table ``[radio]``, where it is not the default: `Estimator` takes it.
    radio: dict[str, Any] | None = None


def read_sigmf(name: str | os.PathLike[str]) -> Recording:
    """A recording by its name or either of its files (``.sigmf-meta``, ``.sigmf-data``).

    Raises
    ------
    ValueError
        Naming the file, and the key or length that is wrong.
    """
    (iq, beams, exponents), codebook, gmt, uav, attitude, radio = _cslam.read_sigmf(os.fspath(name))
    known = (None if value is None else np.array(value) for value in (gmt, uav, attitude))
    return Recording(iq, beams, exponents, codebook, *known, radio=radio and json.loads(radio))


def write_sigmf(
    name: str | os.PathLike[str],
    iq: ArrayLike,
    beams: ArrayLike,
    exponents: ArrayLike,
    *,
    gmt_position_m: ArrayLike | None = None,
    uav_position_m: ArrayLike | None = None,
    uav_quaternion_wb: ArrayLike | None = None,
    radio: dict[str, Any] | None = None,
) -> None:
    """Writes NAME.sigmf-data and NAME.sigmf-meta, which ``cslam estimate`` reads. Arrays as in `Recording`.

    Raises
    ------
    ValueError
        With the shape or type that was met and the one that was expected, or the file that cannot be written.
    """
    samples = np.asarray(iq)
    if samples.dtype != np.int16 or samples.ndim != 4:
        raise ValueError(f"iq: got {samples.dtype} {list(samples.shape)}, expected int16 [beams, 32, 512, 2]")
    count = samples.shape[0]
    place = lambda name, value, n: None if value is None else floats(name, value, (n,)).tolist()  # noqa: E731
    _cslam.write_sigmf(
        os.fspath(name),
        dense(samples),
        integers("beams", beams, np.uint16, (count,)),
        integers("exponents", exponents, np.int32, (count,)),
        place("gmt_position_m", gmt_position_m, 3),
        place("uav_position_m", uav_position_m, 3),
        place("uav_quaternion_wb", uav_quaternion_wb, 4),
        radio and json.dumps(radio),
    )


def write_links(file: str | os.PathLike[str], links: Iterable[Link]) -> None:
    """Writes links in the paths format (``.jsonl``), which ``cslam synth``, ``solve``, ``classify`` and ``fly --paths`` read."""
    Path(file).write_text("".join(link.to_json() + "\n" for link in links))


def read_links(file: str | os.PathLike[str]) -> list[Link]:
    """Links of a path list of a tracer (``.jsonl``)."""
    return [Link.from_json(line) for line in Path(file).read_text().splitlines() if line.strip()]


def read_packets(
    file: str | os.PathLike[str],
    *,
    keys: Sequence[str | os.PathLike[str]] = (),
    test_key: bool = False,
    unsigned: bool = False,
) -> list[dict[str, Any]]:
    """What a UAV said: every packet of a file as ``cslam ground --file FILE --json`` prints it.

    ``keys``: key files of the UAVs; ``test_key=True`` for a simulated flight, ``unsigned=True`` for packets without a signature. A frame
    that is damaged or not signed as it should be is an entry that says so.
    """
    asked = [bool(keys), test_key, unsigned]
    if sum(asked) != 1:
        raise ValueError("expected one of keys=[FILE, ...], test_key=True (a simulated flight) and unsigned=True")
    trust = ("keys", "test", "unsigned")[asked.index(True)]
    lines = _cslam.read_packets(os.fspath(file), [os.fspath(key) for key in keys], trust)
    return [json.loads(line) for line in lines.splitlines()]


@dataclasses.dataclass(frozen=True)
class Smoothed:
    """A flight's best trajectory, from all that was measured before and after each instant, and the map from it."""

    #: ``[n, 8]``: time in s, position in m, quaternion x, y, z, w (the TUM format).
    trajectory: Floats
    #: Columns of the map (``map_smoothed.ply``) by name, ``x``, ``y``, ``z`` in m among them.
    map: dict[str, Floats]


@dataclasses.dataclass(frozen=True)
class Flight:
    """A flight over a recording."""

    #: Everything that ``report.json`` holds.
    report: dict[str, Any]
    #: ``[n, 8]``: time in s, position in m, quaternion x, y, z, w (the TUM format).
    trajectory: Floats
    #: Columns of the map (``map.ply``) by name, ``x``, ``y``, ``z`` in m among them.
    map: dict[str, Floats]
    #: Directory of the flight's files; None when it was a temporary one.
    directory: Path | None
    #: The same flight smoothed; None when that was not asked for. Its figures are ``report["smoothed"]``.
    smoothed: Smoothed | None = None


def fly(
    directory: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    sweeps: int | None = None,
    smooth: bool = False,
) -> Flight:
    """Flies the receiver over a recorded flight (``cslam record``), as ``cslam fly --recording``. Releases the GIL; Ctrl-C ends it.

    ``out``: directory for the flight's files, as that command's ``--out``; left out, they are not kept. ``sweeps``: at most this many.
    ``smooth``: compute the best trajectory afterwards, as ``cslam fly --smooth``; what was on board stays as it is.

    Raises
    ------
    ValueError
        Naming the file that is missing or damaged, or the directory that cannot be used.
    """
    with tempfile.TemporaryDirectory() as temporary:
        written = Path(temporary) / "out" if out is None else Path(out)
        report = json.loads(_cslam.fly(os.fspath(directory), os.fspath(written), sweeps, bool(smooth)))
        return Flight(
            report=report,
            trajectory=_read_tum(written / "trajectory.tum"),
            map=_read_ply(written / "map.ply"),
            directory=None if out is None else written,
            smoothed=_read_smoothed(written) if smooth else None,
        )


def _read_smoothed(written: Path) -> Smoothed:
    return Smoothed(trajectory=_read_tum(written / "trajectory_smoothed.tum"), map=_read_ply(written / "map_smoothed.ply"))


def _read_tum(file: Path) -> Floats:
    """Poses as text; none when the flight was too short for one."""
    lines = (line for line in file.read_text().splitlines() if line and not line.startswith("#"))
    return np.array([line.split() for line in lines], dtype=np.float64).reshape(-1, 8)


def _read_ply(file: Path) -> dict[str, Floats]:
    """Columns of a point cloud as text."""
    lines = file.read_text().splitlines()
    end = lines.index("end_header")
    names = [line.split()[-1] for line in lines[:end] if line.startswith("property")]
    rows = np.array([line.split() for line in lines[end + 1 :]], dtype=np.float64).reshape(-1, len(names))
    return {name: rows[:, column] for column, name in enumerate(names)}
