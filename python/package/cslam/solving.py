"""From paths to reflection points and link states."""

from __future__ import annotations

import dataclasses
from typing import Any, Mapping, Union

import numpy as np
from numpy.typing import ArrayLike

from cslam import _cslam
from cslam._shapes import Floats, floats
from cslam.estimation import Paths
from cslam.world import Link

#: Paths as columns: of an estimator, of a traced link, or of your own by the names of `Link`.
AnyPaths = Union[Paths, Link, Mapping[str, Any]]
#: Errors of a path whose columns have none: range 0.05 m, arrival 0.1 deg, departure 2 deg (the receiver's error budget).
_SIGMAS = (0.05, np.radians(0.1), np.radians(2.0))


@dataclasses.dataclass(frozen=True)
class Points:
    """Reflection points, one a path."""

    #: ``[n, 3]``, world axes, m; NaN where there is none.
    position_m: Floats
    #: ``[n, 3, 3]``, m^2; NaN where there is none.
    covariance_m2: Floats
    #: ``"ok"``, or why there is none, in words.
    verdict: list[str]

    def __len__(self) -> int:
        return len(self.verdict)

    @property
    def ok(self) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """``[n]``, where there is a point."""
        return np.array([verdict == "ok" for verdict in self.verdict], dtype=bool)


def solve(
    paths: AnyPaths,
    *,
    uav_m: ArrayLike | None = None,
    gmt_m: ArrayLike | None = None,
    attitude_wxyz: ArrayLike | None = None,
    uav_sigma_m: float = 0.05,
    attitude_sigma_rad: float = 0.0,
    clock_offset_m: float = 0.0,
    ground_z_m: float | None = None,
    bounds_m: ArrayLike | None = None,
    max_sigma_m: float | None = None,
    open_gates: bool = False,
) -> Points:
    """Where each path was reflected, if it was reflected once. In double precision.

    Parameters
    ----------
    paths
        `Paths` of an `Estimator`; or a `Link`, or a mapping with ``c_tau_m [n]`` and ``aoa_world [n, 3]`` or ``aoa_body [n, 3]``, and
        where known ``aod_world [n, 3]``, ``aod_sigma_rad [n]``, ``covariance [n, 3, 3]``. Without covariance the receiver's error
        budget is taken: 0.05 m, 0.1 degrees, 2 degrees for departures.
    uav_m, gmt_m
        ``[3]``, positions, m. A `Link` has them.
    attitude_wxyz
        ``[4]``, turns ``aoa_body`` into the world; level, nose to the east when left out.
    uav_sigma_m, attitude_sigma_rad
        Standard deviations of the pose, an axis.
    clock_offset_m
        Subtracted from ``c_tau_m``.
    ground_z_m, bounds_m
        Height of the ground; ``[[x0, y0, z0], [x1, y1, z1]]``: points beyond are of higher order.
    max_sigma_m
        Largest error of a point.
    open_gates
        Solve whatever has a solution.
    """
    columns = _columns(paths, uav_m, gmt_m, attitude_wxyz, uav_sigma_m, attitude_sigma_rad, clock_offset_m)
    gates = {
        "open_gates": open_gates,
        "ground_z_m": ground_z_m,
        "bounds_m": None if bounds_m is None else floats("bounds_m", bounds_m, (2, 3)).tolist(),
        "max_sigma_m": max_sigma_m,
    }
    return Points(*_cslam.solve(columns, gates))


def classify(
    paths: AnyPaths,
    *,
    uav_m: ArrayLike | None = None,
    gmt_m: ArrayLike | None = None,
    attitude_wxyz: ArrayLike | None = None,
    uav_sigma_m: float = 0.05,
    attitude_sigma_rad: float = 0.0,
    clock_offset_m: float = 0.0,
    gain_db: ArrayLike | None = None,
) -> Floats:
    """Probabilities ``[n, 3]`` of line of sight, one reflection, and more, by the networks that fly; NaN where a path is no measurement.

    Paths of a link are judged together: give all of them, strongest first. ``gain_db`` ``[n]``: power gain between half-wave dipoles, NaN
    where unknown; a `Link` has it. The other parameters are those of `solve`.
    """
    columns = _columns(paths, uav_m, gmt_m, attitude_wxyz, uav_sigma_m, attitude_sigma_rad, clock_offset_m)
    if gain_db is not None:
        columns["gain_db"] = floats("gain_db", gain_db, (len(columns["c_tau_m"]),))
    return _cslam.classify(columns)


def _columns(
    paths: AnyPaths,
    uav_m: ArrayLike | None,
    gmt_m: ArrayLike | None,
    attitude_wxyz: ArrayLike | None,
    uav_sigma_m: float,
    attitude_sigma_rad: float,
    clock_offset_m: float,
) -> dict[str, Any]:
    """What the compiled half takes."""
    if isinstance(paths, (Paths, Link)):
        given: Mapping[str, Any] = paths.to_dict()
    else:
        given = paths
    uav_m = given.get("rx_m") if uav_m is None else uav_m
    gmt_m = given.get("tx_m") if gmt_m is None else gmt_m
    for name, value in (("uav_m", uav_m), ("gmt_m", gmt_m)):
        if value is None:
            raise ValueError(f"{name}: got none, expected a position [3]: these paths have none of their own")
    if "c_tau_m" not in given:
        raise ValueError("paths: expected a column c_tau_m")
    c_tau_m = floats("c_tau_m", given["c_tau_m"], (None,)) - float(clock_offset_m)
    n = len(c_tau_m)
    in_body = "aoa_body" in given and "aoa_world" not in given
    if not in_body and "aoa_world" not in given:
        raise ValueError("paths: expected a column aoa_world or aoa_body")
    attitude = None
    if in_body:
        attitude = floats("attitude_wxyz", [1, 0, 0, 0] if attitude_wxyz is None else attitude_wxyz, (4,)).tolist()
    elif attitude_wxyz is not None:
        raise ValueError("attitude_wxyz: got one with arrivals in world axes, expected none")
    range_m, aoa_rad, aod_rad = _SIGMAS
    covariance = given.get("covariance")
    if covariance is None:
        covariance = np.tile(np.diag([range_m**2, aoa_rad**2, aoa_rad**2]), (n, 1, 1))
    aod_world = given.get("aod_world")
    aod_sigma_rad = given.get("aod_sigma_rad")
    gain_db = given.get("gain_db")
    name = "aoa_body" if in_body else "aoa_world"
    turned = float(attitude_sigma_rad) ** 2
    place = float(uav_sigma_m) ** 2
    return {
        "c_tau_m": c_tau_m,
        "aoa": floats(name, given[name], (n, 3)),
        "aod": np.full((n, 3), np.nan) if aod_world is None else floats("aod_world", aod_world, (n, 3)),
        "aod_sigma_rad": np.full(n, aod_rad) if aod_sigma_rad is None else floats("aod_sigma_rad", aod_sigma_rad, (n,)),
        "covariance": floats("covariance", covariance, (n, 3, 3)),
        "gain_db": np.full(n, np.nan) if gain_db is None else floats("gain_db", gain_db, (n,)),
        "attitude_wxyz": attitude,
        "attitude_covariance_rad2": np.diag([turned] * 3).tolist(),
        "uav_m": floats("uav_m", uav_m, (3,)).tolist(),
        "uav_covariance_m2": np.diag([place] * 3).tolist(),
        "gmt_m": floats("gmt_m", gmt_m, (3,)).tolist(),
    }
