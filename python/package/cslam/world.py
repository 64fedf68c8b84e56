"""The simulated world: scenes, traced links, and what a front end would hear of them."""

from __future__ import annotations

import dataclasses
import json
import os
from typing import TYPE_CHECKING, Any, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cslam import _cslam
from cslam._shapes import Floats, floats

if TYPE_CHECKING:
    from cslam.files import Recording

SPEED_OF_LIGHT_M_PER_S = 299_792_458.0


def _unit(zenith_rad: Floats, azimuth_rad: Floats) -> Floats:
    sine = np.sin(zenith_rad)
    return np.stack([sine * np.cos(azimuth_rad), sine * np.sin(azimuth_rad), np.cos(zenith_rad)], axis=-1)


@dataclasses.dataclass(frozen=True)
class Link:
    """One transmitter heard by one receiver: its true paths as columns of ``n`` rows, strongest first."""

    #: ``[3]``, transmitter (GMT), m.
    tx_m: Floats
    #: ``[3]``, receiver (UAV), m.
    rx_m: Floats
    #: ``[n]``, reflections: 0 is line of sight.
    order: NDArray[np.int64]
    #: ``[n]``, length of the way, m.
    c_tau_m: Floats
    #: ``[n, 2]``, zenith and azimuth of arrival, rad.
    aoa_rad: Floats
    #: ``[n, 2]``, zenith and azimuth of departure, rad.
    aod_rad: Floats
    #: ``[n]``, complex amplitude between vertical half-wave dipoles, carrier phase excluded.
    gain: NDArray[np.complex128]
    #: ``[n, 3]``, first point that the wave met, m; NaN for line of sight.
    first_vertex_m: Floats
    #: ``[n, 3]``, last one.
    last_vertex_m: Floats

    def __len__(self) -> int:
        return len(self.c_tau_m)

    @property
    def aoa_world(self) -> Floats:
        """``[n, 3]``, unit vectors of arrival."""
        return _unit(self.aoa_rad[:, 0], self.aoa_rad[:, 1])

    @property
    def aod_world(self) -> Floats:
        """``[n, 3]``, unit vectors of departure."""
        return _unit(self.aod_rad[:, 0], self.aod_rad[:, 1])

    @property
    def gain_db(self) -> Floats:
        """``[n]``, power gain, dB."""
        with np.errstate(divide="ignore"):
            return 20 * np.log10(np.abs(self.gain))

    def to_dict(self) -> dict[str, NDArray[Any]]:
        """All columns by name."""
        names = [field.name for field in dataclasses.fields(self)] + ["aoa_world", "aod_world", "gain_db"]
        return {name: getattr(self, name) for name in names}

    def to_json(self) -> str:
        """A line of the paths format (docs/formats.md), as every command reads it."""
        paths = []
        for i in range(len(self)):
            path: dict[str, Any] = {
                "order": int(self.order[i]),
                "delay_s": float(self.c_tau_m[i]) / SPEED_OF_LIGHT_M_PER_S,
                "aoa_zenith_rad": float(self.aoa_rad[i, 0]),
                "aoa_azimuth_rad": float(self.aoa_rad[i, 1]),
                "aod_zenith_rad": float(self.aod_rad[i, 0]),
                "aod_azimuth_rad": float(self.aod_rad[i, 1]),
                "gain": [float(self.gain[i].real), float(self.gain[i].imag)],
            }
            if self.order[i] > 0:
                path["first_vertex"] = self.first_vertex_m[i].tolist()
                path["last_vertex"] = self.last_vertex_m[i].tolist()
            paths.append(path)
        return json.dumps({"tx": self.tx_m.tolist(), "rx": self.rx_m.tolist(), "paths": paths})

    @classmethod
    def from_json(cls, line: str) -> Link:
        """A line of the paths format with all that a tracer knows.

        Raises
        ------
        ValueError
            Naming the key that is missing.
        """
        link = json.loads(line)
        try:
            paths = link["paths"]
            column = lambda key: np.array([p[key] for p in paths], dtype=np.float64)  # noqa: E731
            place = lambda key: np.array([p.get(key) or [np.nan] * 3 for p in paths], dtype=np.float64).reshape(-1, 3)  # noqa: E731
            gain = np.array([p["gain"] for p in paths], dtype=np.float64).reshape(-1, 2)
            return cls(
                tx_m=np.array(link["tx"], dtype=np.float64),
                rx_m=np.array(link["rx"], dtype=np.float64),
                order=np.array([p["order"] for p in paths], dtype=np.int64),
                c_tau_m=column("delay_s") * SPEED_OF_LIGHT_M_PER_S,
                aoa_rad=np.stack([column("aoa_zenith_rad"), column("aoa_azimuth_rad")], axis=-1),
                aod_rad=np.stack([column("aod_zenith_rad"), column("aod_azimuth_rad")], axis=-1),
                gain=gain[:, 0] + 1j * gain[:, 1],
                first_vertex_m=place("first_vertex"),
                last_vertex_m=place("last_vertex"),
            )
        except KeyError as error:
            raise ValueError(f"link: expected a key {error}") from None


class Scene:
    """A scene: ``outdoor``, ``indoor``, ``street``, ``outdoor_a``, ``city:SEED``, ``indoor:SEED``, or a JSON, OBJ or PLY file.

    Raises
    ------
    ValueError
        Naming the file and what is wrong with it.
    """

    def __init__(self, name: str | os.PathLike[str] = "outdoor") -> None:
        self._core = _cslam.Scene(os.fspath(name))

    @property
    def name(self) -> str:
        """Its name."""
        return self._core.name

    @property
    def frequency_hz(self) -> float:
        """Carrier, Hz."""
        return self._core.frequency_hz

    @property
    def bounds_m(self) -> Floats:
        """``[2, 3]``, corners of least and of greatest coordinates, m."""
        return np.array(self._core.bounds_m)

    def trace(self, tx_m: ArrayLike, rx_m: ArrayLike, *, max_order: int = 3) -> list[Link]:
        """Line of sight and specular reflections of every transmitter with every receiver. Releases the GIL.

        ``tx_m``, ``rx_m``: ``[3]`` or ``[k, 3]``, m. ``max_order``: greatest number of reflections, 0 to 6. One link a pair, transmitter by
        transmitter, without paths where nothing arrives.
        """
        places = [np.atleast_2d(np.asarray(value, dtype=np.float64)) for value in (tx_m, rx_m)]
        tx, rx = (floats(name, value, (None, 3)) for name, value in zip(("tx_m", "rx_m"), places))
        return [Link.from_json(line) for line in self._core.trace(tx, rx, max_order)]

    def __repr__(self) -> str:
        return f"Scene({self.name!r}, {self._core.faces} faces)"


def synth(
    link: Link,
    *,
    seed: int = 1,
    snr_offset_db: float = 0.0,
    impairments: bool = True,
    attitude_wxyz: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
) -> Recording:
    """What the receiver's front end would hear of a link: a sweep of 72 beams, with noise, converter and the errors of both ends.

    ``impairments=False`` leaves out the errors of arrays, clock and transmitter: with the default error budget, estimated paths are some
    millimetres and tenths of a degree off the traced ones. The same ``seed`` gives the same samples.
    """
    from cslam.files import Recording

    attitude = floats("attitude_wxyz", attitude_wxyz, (4,))
    (iq, beams, exponents) = _cslam.synth(link.to_json(), seed, snr_offset_db, impairments, attitude.tolist())
    return Recording(iq, beams, exponents, "gmt-72", link.tx_m, link.rx_m, attitude / np.linalg.norm(attitude))


def demo() -> str:
    """A first result: a link is traced, heard, estimated, and its points are solved. Returns what was found, in words."""
    from cslam.estimation import Estimator
    from cslam.solving import solve

    link = Scene("outdoor").trace([0, 0, 1.5], [56, 2, 6])[0]
    heard = synth(link)
    paths = Estimator().estimate(heard.iq, heard.beams, heard.exponents)
    points = solve(paths, uav_m=link.rx_m, gmt_m=link.tx_m, ground_z_m=0.0)
    lines = [f"{len(link)} paths are there, {len(paths)} were measured:"]
    for length, snr, verdict, point in zip(paths.c_tau_m, paths.snr_db, points.verdict, points.position_m):
        where = "reflected at " + " ".join(f"{c:.2f}" for c in point) + " m" if verdict == "ok" else verdict
        lines.append(f"  {length:8.3f} m, {snr:5.1f} dB: {where}")
    return "\n".join(lines)
