"""Recorded flights: written, and read event by event."""

from __future__ import annotations

import json
import os
from typing import Any, Iterator

import numpy as np
from numpy.typing import NDArray

from cslam import _cslam
from cslam._shapes import Floats, whole
from cslam.events import BarometerSample, Beacon, Event, ImuSamples, MagnetometerSample, SweepSamples, TimingExchange
from cslam.files import Recording


class RecordedFlight:
    """A recorded flight (``cslam record``, `record`, or a program of your own), to be iterated over: its events in the order of their arrival.

    Raises
    ------
    ValueError
        Naming the file that is missing or damaged.
    """

    def __init__(self, directory: str | os.PathLike[str]) -> None:
        self._core = _cslam.RecordedFlight(os.fspath(directory))

    @property
    def sweeps(self) -> int:
        """Number of its sweeps."""
        return self._core.sweeps

    @property
    def ground_z_m(self) -> float:
        """Height of the ground, m."""
        return self._core.ground_z_m

    @property
    def radio(self) -> dict[str, Any] | None:
        """The radio, in the form of the configuration's table ``[radio]``; None where it is the default."""
        return None if self._core.radio is None else json.loads(self._core.radio)

    @property
    def gmt_setup_m(self) -> Floats | None:
        """``[3]``, where the transmitter was set up, or None."""
        return None if self._core.gmt_setup_m is None else np.array(self._core.gmt_setup_m)

    @property
    def earth_field_ut(self) -> Floats | None:
        """``[3]``, the earth's magnetic field in world axes, uT, or None."""
        return None if self._core.earth_field_ut is None else np.array(self._core.earth_field_ut)

    def __iter__(self) -> Iterator[Event]:
        self._core.rewind()
        return iter(self._next, None)

    def _next(self) -> Event | None:
        event = self._core.event()
        if event is None:
            return None
        kind, *data = event
        return _EVENTS[kind](*data)


def record(
    out: str | os.PathLike[str],
    scene: str | os.PathLike[str] | None = None,
    *,
    channel: str | os.PathLike[str] | None = None,
    world: str | None = None,
    seed: int = 1,
    sweeps: int | None = None,
) -> dict[str, Any]:
    """Records a simulated flight, as ``cslam record``: 8.5 MB a sweep, two sweeps per second. Releases the GIL; Ctrl-C ends it.

    ``out``: a directory, made when missing; an older recording in it is replaced. ``scene``: its name or a file; ``outdoor`` by default.
    ``channel``: a path list, line by line the links of consecutive sweeps that a ray tracer of yours found (:mod:`cslam.bridge`), is
    flown instead; ``scene`` is then what a map of it is compared with. ``world``: ``ideal``, ``budget`` or ``real``, the default.
    ``sweeps``: at most this many, instead of two minutes. Gives what ``flight.json`` in it says.

    Raises
    ------
    ValueError
        Naming what is not known, or the directory that cannot be used.
    """
    sweeps = None if sweeps is None else whole("sweeps", sweeps, 1, 10**6)
    scene, channel = (None if file is None else os.fspath(file) for file in (scene, channel))
    return json.loads(_cslam.record(os.fspath(out), scene, channel, world, whole("seed", seed, 0, 2**64 - 1), sweeps))


def _inertial(times: NDArray[np.uint64], rates: Floats, forces: Floats) -> ImuSamples:
    return ImuSamples(times, rates.reshape(-1, 3), forces.reshape(-1, 3))


def _sweep(time_ns: int, sweep: int, beams: Any, squint: Any, pilots: Any) -> SweepSamples:
    return SweepSamples(
        time_ns,
        sweep,
        beams and Recording(*beams),
        squint and Recording(*squint, codebook="bsm-seq"),
        pilots and Recording(*pilots, codebook="gmt-72-pilots"),
    )


def _beacon(time_ns: int, sweep: int, place: Any, sweeps_per_stop: int) -> Beacon:
    position, angles, sigma_m = place
    return Beacon(time_ns, sweep, np.array(position), np.array(angles), sigma_m, sweeps_per_stop)


_EVENTS = {
    "imu": _inertial,
    "magnetometer": lambda time_ns, field: MagnetometerSample(time_ns, np.array(field)),
    "timing": TimingExchange,
    "sweep": _sweep,
    "beacon": _beacon,
    "barometer": BarometerSample,
}
