"""From samples to paths."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cslam import _cslam
from cslam._shapes import Floats, dense, integers

CHANNELS = 32
SAMPLES = 512
#: Level of the strongest channel behind the gain control, of a full scale of 32768, and bits of the converter.
_LEVEL = 32768.0 * 10 ** (-12 / 20)
_BITS = 12


@dataclasses.dataclass(frozen=True)
class Paths:
    """Paths of a sweep, strongest first, as columns of ``n`` rows.

    ``print(paths)`` gives the lines of ``cslam estimate --csv``, and of the examples in Rust and C, character for character.
    """

    #: ``[n]``, speed of light times delay, clock offset included, m; cyclic with 625 m.
    c_tau_m: Floats
    #: ``[n, 3]``, unit vectors of arrival, body axes.
    aoa_body: Floats
    #: ``[n, 3]``, unit vectors of departure, world axes; NaN where the beams did not show it.
    aod_world: Floats
    #: ``[n]``, standard deviation of the departure along any tangent, rad; NaN where there is none.
    aod_sigma_rad: Floats
    #: ``[n]``, SNR per element and active subcarrier in the strongest beam, dB.
    snr_db: Floats
    #: ``[n]``, uint16, the strongest beam.
    beam: NDArray[np.uint16]
    #: ``[n, 3, 3]``, covariance by noise of (c tau, angles along the tangents e1, e2 of the arrival): m^2, m rad, rad^2.
    covariance: Floats
    _text: str = dataclasses.field(repr=False, default="")

    def __len__(self) -> int:
        return len(self.c_tau_m)

    def __str__(self) -> str:
        return self._text.rstrip("\n")

    def to_dict(self) -> dict[str, NDArray[Any]]:
        """The columns by name, as for ``pandas.DataFrame`` (of those with one dimension) or ``numpy.savez``."""
        names = (field.name for field in dataclasses.fields(self))
        return {name: getattr(self, name) for name in names if not name.startswith("_")}


class Estimator:
    """The path estimator that flies.

    Parameters
    ----------
    mode
        ``"best"``; ``"paper"`` and ``"paper-interpolated"`` are the published method.
    gmt_heading_rad
        Azimuth at which the first face of the transmitter looks.
    false_alarms_per_sweep
        On noise alone, above 0 and at most 1.
    dynamic_range_db
        Paths weaker than the strongest one by more are not reported, 0 to 120.
    screening
        Pass over beams that show only known paths: faster.
    follow
        Sweeps follow each other as in flight, and what one shows of the noise helps the next; one estimator a flight, one thread at a
        time. Without it every call stands alone, whatever came before, and threads may share the estimator.
    radio
        Another radio than the default, in the form of the configuration's table ``[radio]`` (``cslam config`` shows it), as far as it
        differs: ``{"waveform": {"carrier_hz": 28e9, "root": 136}}``. How many arrays, elements and beams there are stays.

    Raises
    ------
    ValueError
        Naming the parameter that cannot be.
    """

    def __init__(
        self,
        *,
        mode: str = "best",
        gmt_heading_rad: float = 0.0,
        false_alarms_per_sweep: float = 1e-2,
        dynamic_range_db: float = 34.0,
        screening: bool = True,
        follow: bool = False,
        radio: dict[str, Any] | None = None,
    ) -> None:
        told = radio and json.dumps(radio)
        self._core = _cslam.Estimator(mode, gmt_heading_rad, false_alarms_per_sweep, dynamic_range_db, screening, follow, told)

    def estimate(self, iq: ArrayLike, beams: ArrayLike, exponents: ArrayLike | None = None) -> Paths:
        """The paths of one sweep. Releases the GIL.

        Parameters
        ----------
        iq
            int16 ``[b, 32, 512, 2]`` (beam, channel, sample, I and Q), full scale 32768; or complex ``[b, 32, 512]``, amplitudes as
            they are, which are converted as by the front end (`quantize`). Channels are array-major: ``8 j + i``. At most 72 beams,
            in any order.
        beams
            ``[b]``, transmit beam of each block, 0 to 71, none twice.
        exponents
            ``[b]``, **one for each beam**: amplitude = integer x 2^exponent. Not for complex samples.

        Raises
        ------
        ValueError
            With the shape, type or range that was met and the one that was expected.
        """
        samples = np.asarray(iq)
        if samples.dtype.kind == "c":
            if exponents is not None:
                raise ValueError("exponents: got some with complex samples, expected none: these have their amplitudes")
            samples, exponents = quantize(samples)
        elif samples.dtype != np.int16:
            raise ValueError(f"iq: got {samples.dtype}, expected int16 [beams, 32, 512, 2] or complex [beams, 32, 512]")
        elif exponents is None:
            raise ValueError("exponents: got none, expected one a beam: int16 samples have a scale of their own in each beam")
        if samples.ndim != 4:
            raise ValueError(f"iq: got shape {list(samples.shape)}, expected [beams, {CHANNELS}, {SAMPLES}, 2]")
        count = samples.shape[0]
        return Paths(
            *self._core.estimate(
                dense(samples),
                integers("beams", beams, np.uint16, (count,)),
                integers("exponents", exponents, np.int32, (count,)),
            )
        )


def quantize(iq: ArrayLike) -> tuple[NDArray[np.int16], NDArray[np.int32]]:
    """Complex samples ``[b, 32, 512]`` as the front end hands them over.

    Gain control holds the strongest channel of each beam at 12 dB under full scale; 12 bits, left-aligned in 16, rounded half up.
    Returns int16 ``[b, 32, 512, 2]`` and int32 ``[b]``, the exponent of each beam.

    Raises
    ------
    ValueError
        For another shape, or a sample that is not finite.
    """
    samples = np.asarray(iq)
    if samples.ndim != 3 or samples.shape[1:] != (CHANNELS, SAMPLES):
        raise ValueError(f"iq: got shape {list(samples.shape)}, expected [beams, {CHANNELS}, {SAMPLES}]")
    samples = dense(samples, np.complex128)
    if not np.isfinite(samples).all():
        raise ValueError("iq: a sample is not finite")
    strongest = (np.abs(samples) ** 2).mean(axis=2).max(axis=1, initial=0.0)
    with np.errstate(divide="ignore"):
        level = np.ceil(0.5 * np.log2(strongest / _LEVEL**2))
    # Beyond this no receiver hears, and single precision ends.
    exponents = np.clip(np.where(strongest > 0, level, -100), -100, 100).astype(np.int32)
    shift = 16 - _BITS
    steps = np.ldexp(samples.view(np.float64).reshape(*samples.shape, 2), -(exponents + shift)[:, None, None, None])
    limit = 1 << (_BITS - 1)
    return (np.clip(np.floor(steps + 0.5), -limit, limit - 1).astype(np.int16) << shift), exponents
