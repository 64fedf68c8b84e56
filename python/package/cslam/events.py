"""What reaches the receiver in a flight."""

from __future__ import annotations

import dataclasses
from typing import Union

import numpy as np
from numpy.typing import NDArray

from cslam._shapes import Floats
from cslam.files import Recording


@dataclasses.dataclass(frozen=True)
class ImuSamples:
    """Samples of the inertial sensor, in order; each is over the interval that ends at its time."""

    #: ``[n]``, uint64, clock of the UAV.
    time_ns: NDArray[np.uint64]
    #: ``[n, 3]``, angular rate, body axes.
    rate_rad_per_s: Floats
    #: ``[n, 3]``, specific force, body axes: +9.8 along z at rest.
    specific_force_m_per_s2: Floats


@dataclasses.dataclass(frozen=True)
class MagnetometerSample:
    """A sample of the magnetometer."""

    time_ns: int
    #: ``[3]``, body axes, uT.
    field_ut: Floats


@dataclasses.dataclass(frozen=True)
class TimingExchange:
    """A two-way timing exchange."""

    time_ns: int
    #: Clock of the UAV less that of the transmitter, s.
    clock_offset_s: float


@dataclasses.dataclass(frozen=True)
class SweepSamples:
    """Samples of a sweep, which began at ``time_ns``."""

    time_ns: int
    sweep: int
    #: Transmit beams; None when all are lost.
    beams: Recording | None
    #: Beam squint symbols 0 to 32 behind them, ``beams`` of which are their numbers; None when there are none.
    squint: Recording | None = None
    #: Pilots: some of the beams, sent twice again. ``beams`` of the first ones are the numbers of their beams, of the second ones 72 more; a first one
    #: comes before its second. None when there are none: nothing is lost but how fast paths grow.
    pilots: Recording | None = None


@dataclasses.dataclass(frozen=True)
class Beacon:
    """What the transmitter says of a sweep, and when that was heard."""

    time_ns: int
    sweep: int
    #: ``[3]``, its antenna during that sweep, world axes, m; steps of 0.1 mm.
    position_m: Floats
    #: ``[3]``: of its mast about z, then about the new y, then about the new x, -pi to pi.
    heading_pitch_roll_rad: Floats
    #: Standard deviation of the position, m an axis, 0 to 6.5.
    sigma_m: float
    #: Sweeps from one place before it moves on.
    sweeps_per_stop: int


@dataclasses.dataclass(frozen=True)
class BarometerSample:
    """A sample of the barometer. The receiver has no input for it."""

    time_ns: int
    pressure_pa: float


Event = Union[ImuSamples, MagnetometerSample, TimingExchange, SweepSamples, Beacon, BarometerSample]
