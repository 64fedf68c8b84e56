"""The whole receiver: sensors and samples in, pose, map and packets out."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cslam import _cslam
from cslam._shapes import MOST, Floats, dense, finite, floats, integers, three, time_of, whole, within
from cslam.events import BarometerSample, Beacon, Event, ImuSamples, MagnetometerSample, SweepSamples, TimingExchange
from cslam.files import Recording
from cslam.recorded import RecordedFlight

_LINK_STATES = ("outage", "line of sight", "first order", "higher order")


@dataclasses.dataclass(frozen=True)
class Pose:
    """Where the UAV is."""

    #: Clock of the UAV.
    time_ns: int
    #: ``[3]``, world axes, m.
    position_m: Floats
    #: ``[4]``.
    quaternion_wb: Floats
    #: ``[3]``, world axes, m/s.
    velocity_m_per_s: Floats
    #: Clock of the UAV less that of the transmitter; NaN while whole delay periods are not known.
    clock_offset_s: float
    #: Its standard deviation.
    clock_sigma_s: float
    #: ``[3, 3]``, m^2.
    position_covariance_m2: Floats
    #: ``[3, 3]``, of a small rotation vector in world axes, rad^2.
    attitude_covariance_rad2: Floats
    #: ``[3, 3]``, m^2/s^2.
    velocity_covariance_m2_per_s2: Floats
    #: Counts the jumps: poses with different counts must not be differenced.
    resets: int


@dataclasses.dataclass(frozen=True)
class Swept:
    """What the receiver made of a sweep: ``n`` paths, strongest first, and ``m`` points that it added to the map."""

    sweep: int
    #: Its start by the clock of the UAV.
    time_ns: int
    #: ``outage``, ``line of sight``, ``first order`` or ``higher order``: of its strongest path.
    link_state: str
    #: Whether a line of sight corrected the pose or set it.
    los_used: bool
    #: What the line of sight did to the pose, in words.
    los_verdict: str
    #: At its start, with the sweep taken in; None before there is one.
    pose: Pose | None
    #: ``[n]``, m, clock offset included.
    path_c_tau_m: Floats
    #: ``[n, 3]``, unit vectors of arrival, body axes.
    path_aoa_body: Floats
    #: ``[n]``, dB.
    path_snr_db: Floats
    #: ``n`` words: what became of each.
    path_verdict: list[str]
    #: ``[m, 3]``, world axes, m; of this sweep and of earlier ones that waited for their surfaces.
    point_position_m: Floats
    #: ``[m]``, trace of the covariance, m^2.
    point_covariance_trace_m2: Floats
    #: ``[m]``, that its surfaces exist.
    point_probability: Floats
    #: ``[m]``, int32, number of its surface; -1 where none is known.
    point_surface: NDArray[np.int32]
    #: Surfaces that are believed no more: their points have left the map.
    withdrawn: list[int]


class Receiver:
    """The receiver that flies on a board, with its capacities: what it is told, in the order of its arrival, is all that it knows.

    Parameters
    ----------
    ground_z_m
        Height of the ground at the start, m; None when nobody knows.
    earth_field_ut
        ``[3]``, the earth's magnetic field in world axes, uT; without it the magnetometer is not used.
    gmt_setup_m
        ``[3]``, where whoever set the transmitter up says that its antenna stands at first; a first beacon further off than
        ``gmt_setup_within_m`` is refused. Without it nobody asks.
    uav
        Its number in packets.
    key
        32 bytes, secret of the link, with which packets are signed; without it the published test key.
    radio
        Another radio than the default, as `Estimator` takes it.

    Raises
    ------
    ValueError
        Naming the parameter that cannot be.
    """

    def __init__(
        self,
        *,
        ground_z_m: float | None = 0.0,
        earth_field_ut: ArrayLike | None = None,
        gmt_setup_m: ArrayLike | None = None,
        gmt_setup_within_m: float = 1.0,
        uav: int = 1,
        key: bytes | None = None,
        radio: dict[str, Any] | None = None,
    ) -> None:
        if ground_z_m is not None:
            within("ground_z_m", ground_z_m, -MOST, MOST)
        field = None if earth_field_ut is None else three("earth_field_ut", earth_field_ut)
        if field is not None and not 10 <= np.linalg.norm(field) <= 100:
            raise ValueError(f"earth_field_ut: got a field of {np.linalg.norm(field):.3g} uT, expected 10 to 100 (the earth's is 22 to 67)")
        within("gmt_setup_within_m", gmt_setup_within_m, 0.001, MOST)
        setup = None if gmt_setup_m is None else (three("gmt_setup_m", gmt_setup_m), float(gmt_setup_within_m))
        if key is not None and (len(key) != 32 or not any(key)):
            raise ValueError(f"key: got {len(key)} bytes, expected 32 that are drawn at random")
        self._core = _cslam.Receiver(ground_z_m, field, setup, whole("uav", uav, 0, 255), key, radio and json.dumps(radio))

    @classmethod
    def of(cls, flight: RecordedFlight, **options: Any) -> Receiver:
        """One that knows of the place what the recording says of it."""
        known = {name: getattr(flight, name) for name in ("ground_z_m", "earth_field_ut", "gmt_setup_m", "radio")}
        return cls(**{**known, **options})

    def feed(self, event: Event) -> None:
        """An event of a recorded flight, or one made by its class: the method below that takes it. A barometer's is not used."""
        if isinstance(event, ImuSamples):
            self.imu(event.time_ns, event.rate_rad_per_s, event.specific_force_m_per_s2)
        elif isinstance(event, MagnetometerSample):
            self.magnetometer(event.time_ns, event.field_ut)
        elif isinstance(event, TimingExchange):
            self.timing(event.time_ns, event.clock_offset_s)
        elif isinstance(event, SweepSamples):
            if event.beams is not None:
                self.sweep(event.time_ns, event.sweep, event.beams, event.squint, event.pilots)
        elif isinstance(event, Beacon):
            place = (event.position_m, event.heading_pitch_roll_rad, event.sigma_m)
            self.beacon(event.time_ns, event.sweep, *place, event.sweeps_per_stop)
        elif not isinstance(event, BarometerSample):
            raise ValueError(f"event: got {type(event).__name__}, expected an event of a flight")

    def imu(self, time_ns: ArrayLike, rate_rad_per_s: ArrayLike, specific_force_m_per_s2: ArrayLike) -> None:
        """Inertial samples, ``[n]`` and ``[n, 3]``, or one of them: see `ImuSamples`. A thousand per second."""
        times = np.atleast_1d(np.asarray(time_ns))
        if times.dtype.kind not in "iu" or times.ndim != 1 or (times.size and times.min() < 0):
            raise ValueError(f"time_ns: got {times.dtype} {list(times.shape)}, expected whole numbers [n] from 0 on")
        count = len(times)
        rows = lambda name, value: finite(name, floats(name, np.atleast_2d(np.asarray(value)), (count, 3)))  # noqa: E731
        self._core.imu(
            dense(times, np.uint64),
            rows("rate_rad_per_s", rate_rad_per_s),
            rows("specific_force_m_per_s2", specific_force_m_per_s2),
        )

    def magnetometer(self, time_ns: int, field_ut: ArrayLike) -> None:
        """A sample of the magnetometer, ``[3]``, body axes, uT."""
        self._core.magnetometer(time_of(time_ns), three("field_ut", field_ut))

    def timing(self, time_ns: int, clock_offset_s: float) -> None:
        """A two-way exchange: clock of the UAV less that of the transmitter, s, within a second."""
        within("clock_offset_s", clock_offset_s, -1.0, 1.0)
        self._core.timing(time_of(time_ns), clock_offset_s)

    def sweep(
        self,
        time_ns: int,
        sweep: int,
        beams: Recording,
        squint: Recording | None = None,
        pilots: Recording | None = None,
    ) -> bool:
        """The samples of a sweep that began at ``time_ns``; see `SweepSamples`. False when this sweep has ended before: they are not used.

        Numbers of ``beams`` are 0 to 71, of ``pilots`` 0 to 143: of the second pilot of a beam 72 more than of the first.

        It ends when its beacon comes, or 21 ms later by the time of what comes next.
        """
        number, others = whole("sweep", sweep, 0, 2**32 - 1), (told and _blocks(told) for told in (squint, pilots))
        return self._core.sweep(number, time_of(time_ns), _blocks(beams), *others)

    def beacon(
        self,
        time_ns: int,
        sweep: int,
        position_m: ArrayLike,
        heading_pitch_roll_rad: ArrayLike = (0.0, 0.0, 0.0),
        sigma_m: float = 0.02,
        sweeps_per_stop: int = 1,
    ) -> None:
        """What the transmitter says of a sweep, heard at ``time_ns``; see `Beacon`. The binding signs it and hands it over as a packet."""
        angles = three("heading_pitch_roll_rad", heading_pitch_roll_rad)
        if max(map(abs, angles)) > math.pi:
            raise ValueError(f"heading_pitch_roll_rad: got {angles}, expected -pi to pi")
        within("sigma_m", sigma_m, 0.0, 6.5)
        stops = whole("sweeps_per_stop", sweeps_per_stop, 1, 65535)
        place = (three("position_m", position_m), angles, float(sigma_m))
        self._core.beacon(time_of(time_ns), whole("sweep", sweep, 0, 2**32 - 1), place, stops)

    def elapse(self, time_ns: int) -> None:
        """Tells the time: a sweep that will not be whole any more ends."""
        self._core.elapse(time_of(time_ns))

    def end(self) -> None:
        """The flight ends: the sweep in hand, and what waited for more to be sent with it."""
        self._core.end()

    @property
    def pose(self) -> Pose | None:
        """Pose by the newest inertial samples; None before there is one."""
        return _pose(self._core.pose())

    @property
    def map(self) -> dict[str, NDArray[Any]]:
        """Columns of the map: ``position_m`` ``[k, 3]``, ``covariance_trace_m2``, ``hits``, ``surface`` (-1 where none is known)."""
        position, variance, hits, surface = self._core.map()
        return {"position_m": position.reshape(-1, 3), "covariance_trace_m2": variance, "hits": hits, "surface": surface}

    def take_sweeps(self) -> list[Swept]:
        """The sweeps that have ended since the last call."""
        taken = []
        for (sweep, time_ns, link, used, verdict, pose), paths, points, withdrawn in self._core.take_sweeps():
            told = (sweep, time_ns, _LINK_STATES[link], used, verdict, _pose(pose))
            c_tau, aoa, snr, verdicts = paths
            position, trace, probability, surface = points
            columns = (c_tau, aoa.reshape(-1, 3), snr, verdicts, position.reshape(-1, 3), trace, probability, surface)
            taken.append(Swept(*told, *columns, withdrawn))
        return taken

    def take_packets(self) -> bytes:
        """What waits for the radio, as `read_packets` reads it from a file. At most 4096 bytes wait; more is dropped."""
        return bytes(self._core.take_packets())


def _pose(columns: Any) -> Pose | None:
    if columns is None:
        return None
    time_ns, position, quaternion, velocity, offset, sigma, *covariances, resets = columns
    known = [math.nan if value is None else value for value in (offset, sigma)]
    arrays = map(np.array, (position, quaternion, velocity))
    return Pose(time_ns, *arrays, *known, *map(np.array, covariances), resets)


def _blocks(samples: Recording) -> tuple[NDArray[np.int16], NDArray[np.uint16], NDArray[np.int32]]:
    iq = np.asarray(samples.iq)
    if iq.dtype != np.int16 or iq.ndim != 4:
        raise ValueError(f"iq: got {iq.dtype} {list(iq.shape)}, expected int16 [beams, 32, 512, 2] (`quantize` makes them of complex samples)")
    count = (len(iq),)
    numbers = integers("beams", samples.beams, np.uint16, count)
    return dense(iq), numbers, integers("exponents", samples.exponents, np.int32, count)
