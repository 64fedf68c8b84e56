"""Links of other people's ray tracers: Sionna RT and DeepMIMO.

Neither package is needed here: what is read are the attributes of the objects that they give, as arrays. Axes, angles, delays and
amplitudes are those of this package already (checked against both, docs/bindings.md); what differs is their layout, and what kinds of
paths there are. The receiver's models are made for specular paths of at most three reflections; others are dropped and counted.

For amplitudes that mean here what they mean there, trace with vertical half-wave dipoles at both ends
(``PlanarArray(num_rows=1, num_cols=1, pattern="hw_dipole", polarization="V")`` in Sionna RT).
"""

from __future__ import annotations

from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from cslam._shapes import Floats
from cslam.world import SPEED_OF_LIGHT_M_PER_S, Link, _unit

#: More reflections than this are dropped.
MAX_ORDER = 3
#: Numbers of `InteractionType` in Sionna RT, but for reflections.
_SIONNA_KINDS = {2: "diffuse", 4: "refraction", 8: "diffraction"}
#: Digits of `inter` in DeepMIMO, but for reflections.
_DEEPMIMO_KINDS = {2: "diffraction", 3: "scattering", 4: "transmission"}


class Dropped(dict[str, int]):
    """Paths that were left out, by reason: ``diffuse``, ``refraction``, ``diffraction``, ``scattering``, ``transmission``,
    ``more than 3 reflections``, ``not finite``, ``other interaction``, ``angles and places disagree``."""

    def count(self, reason: str) -> None:
        """One more."""
        self[reason] = self.get(reason, 0) + 1

    @property
    def total(self) -> int:
        """All of them."""
        return sum(self.values())


def sionna(paths: Any, scene: Any = None, *, tx_m: Any = None, rx_m: Any = None) -> tuple[list[Link], Dropped]:
    """Links of what ``sionna.rt.PathSolver()(scene, synthetic_array=True, ...)`` gives: one for each pair, transmitter by transmitter.

    Parameters
    ----------
    paths
        With ``tau``, ``theta_t``, ``phi_t``, ``theta_r``, ``phi_r``, ``valid`` ``[rx, tx, p]``, ``a`` (a pair: real and imaginary part)
        ``[rx, 1, tx, 1, p]``, ``interactions`` ``[depth, rx, tx, p]`` and ``vertices`` ``[depth, rx, tx, p, 3]``.
    scene
        With ``transmitters`` and ``receivers``, dictionaries of things with a ``position``, in the order of the arrays; or
    tx_m, rx_m
        ``[k, 3]``, the places, when there is no scene at hand.

    Raises
    ------
    ValueError
        Naming the attribute that is missing or has another shape than was expected.
    """
    tx, rx = _places(scene, "transmitters", "tx_m", tx_m), _places(scene, "receivers", "rx_m", rx_m)
    tau = _array(paths, "tau")
    if tau.ndim != 3 or tau.shape[:2] != (len(rx), len(tx)):
        raise ValueError(
            f"tau: got shape {list(tau.shape)}, expected [{len(rx)}, {len(tx)}, paths]: trace with synthetic_array=True"
        )
    pairs = tau.shape
    angles = {name: _array(paths, name, pairs) for name in ("theta_t", "phi_t", "theta_r", "phi_r", "valid")}
    amplitudes = _attribute(paths, "a")
    if not isinstance(amplitudes, (tuple, list)) or len(amplitudes) != 2:
        raise ValueError("a: expected a pair of arrays, real and imaginary part")
    one = (pairs[0], 1, pairs[1], 1, pairs[2])
    parts = []
    for name, part in zip(("real part", "imaginary part"), amplitudes):
        part = _plain(part)
        if part.shape != one:
            raise ValueError(f"a, {name}: got shape {list(part.shape)}, expected {list(one)}: one antenna at either end")
        parts.append(part[:, 0, :, 0, :].astype(np.float64))
    gain = parts[0] + 1j * parts[1]
    interactions = _array(paths, "interactions")
    depth = interactions.shape[0]
    interactions = _shaped("interactions", interactions, (depth, *pairs))
    vertices = _array(paths, "vertices", (depth, *pairs, 3))
    dropped = Dropped()
    links = []
    for t in range(len(tx)):
        for r in range(len(rx)):
            rows = []
            for p in range(pairs[2]):
                if not angles["valid"][r, t, p] or gain[r, t, p] == 0:
                    continue
                met = [int(kind) for kind in interactions[:, r, t, p] if kind != 0]
                numbers = [tau[r, t, p], *(angles[name][r, t, p] for name in ("theta_r", "phi_r", "theta_t", "phi_t"))]
                reason = _refused(met, _SIONNA_KINDS, [*numbers, gain[r, t, p].real, gain[r, t, p].imag])
                if reason is not None:
                    dropped.count(reason)
                    continue
                rows.append(_row(numbers, gain[r, t, p], vertices[: len(met), r, t, p, :]))
            links.append(_link(tx[t], rx[r], rows))
    return links, dropped


def deepmimo(dataset: Any, *, phase_at_receiver: bool = False) -> tuple[list[Link], Dropped]:
    """Links of a DeepMIMO data set of one base station: one for each user. Of a set of several, give ``dataset[0]``.

    ``dataset`` has, as attributes or keys, ``tx_pos`` ``[3]`` or ``[1, 3]``, ``rx_pos`` ``[u, 3]``, ``delay`` (s), ``power`` (dB), ``phase``,
    ``aoa_el``, ``aoa_az``, ``aod_el``, ``aod_az`` (degrees; "el" are zenith angles) and ``inter`` ``[u, p]``, NaN where there is no path, and
    ``inter_pos`` ``[u, p, depth, 3]``, from the transmitter on.

    Not all of DeepMIMO's converters write zenith angles, and arrivals as seen from the receiver. A path whose angles do not point to its
    vertices, or to the other end, is dropped. A converter keeps the first 25 paths of a user and says nothing of the others: trace without
    kinds that are dropped here.

    ``phase_at_receiver``: the phases hold the way, as those of some tools do; it is taken out with the carrier of
    ``dataset.rt_params.frequency``. Sets made with Sionna RT do not.

    Raises
    ------
    ValueError
        Naming the field that is missing or has another shape than was expected.
    """
    # First, since a set of several base stations gives a list for every field.
    tx = _array(dataset, "tx_pos").reshape(-1)
    if tx.shape != (3,):
        raise ValueError(f"tx_pos: got {tx.size // 3} places, expected one: give the set of one base station, as dataset[0]")
    rx = _array(dataset, "rx_pos")
    if rx.ndim != 2 or rx.shape[1] != 3:
        raise ValueError(f"rx_pos: got shape {list(rx.shape)}, expected [users, 3]")
    delay = _array(dataset, "delay")
    if delay.ndim != 2 or len(delay) != len(rx):
        raise ValueError(f"delay: got shape {list(delay.shape)}, expected [{len(rx)}, paths]")
    names = ("power", "phase", "aoa_el", "aoa_az", "aod_el", "aod_az", "inter")
    fields = {name: _array(dataset, name, delay.shape).astype(np.float64) for name in names}
    places = _array(dataset, "inter_pos")
    if places.ndim != 4 or places.shape[:2] != delay.shape or places.shape[3] != 3:
        raise ValueError(f"inter_pos: got shape {list(places.shape)}, expected {[*delay.shape]} + [depth, 3]")
    carrier_hz = float(_attribute(_attribute(dataset, "rt_params"), "frequency")) if phase_at_receiver else 0.0
    dropped = Dropped()
    links = []
    for u in range(len(rx)):
        rows = []
        for p in range(delay.shape[1]):
            if np.isnan(delay[u, p]) or np.isnan(fields["inter"][u, p]):
                continue
            met = [int(digit) for digit in str(int(fields["inter"][u, p])) if digit != "0"]
            angles = [float(np.radians(fields[name][u, p])) for name in ("aoa_el", "aoa_az", "aod_el", "aod_az")]
            phase = np.radians(fields["phase"][u, p]) + 2 * np.pi * carrier_hz * float(delay[u, p])
            with np.errstate(invalid="ignore"):
                gain = complex(10 ** (fields["power"][u, p] / 20) * np.exp(1j * phase))
            numbers = [float(delay[u, p]), *angles]
            vertices = places[u, p, : len(met), :].astype(np.float64)
            reason = _refused(met, _DEEPMIMO_KINDS, [*numbers, gain.real, gain.imag, *vertices.ravel()])
            if reason is None and len(met) > places.shape[2]:
                reason = "not finite"
            if reason is None and not _agree(tx, rx[u], vertices, angles):
                reason = "angles and places disagree"
            if reason is not None:
                dropped.count(reason)
                continue
            rows.append(_row(numbers, gain, vertices))
        links.append(_link(tx, rx[u], rows))
    return links, dropped


def _attribute(owner: Any, name: str) -> Any:
    """An attribute or a key."""
    if isinstance(owner, Mapping) and name in owner:
        return owner[name]
    try:
        return getattr(owner, name)
    except AttributeError:
        raise ValueError(f"{name}: expected an attribute or a key of this name") from None


def _plain(value: Any) -> NDArray[Any]:
    """An array of whatever has one: NumPy, Dr.Jit, PyTorch, TensorFlow."""
    if hasattr(value, "numpy"):
        value = value.numpy()
    return np.asarray(value)


def _array(owner: Any, name: str, shape: Sequence[int] | None = None) -> NDArray[Any]:
    array = _plain(_attribute(owner, name))
    return array if shape is None else _shaped(name, array, shape)


def _shaped(name: str, array: NDArray[Any], shape: Sequence[int]) -> NDArray[Any]:
    if array.shape != tuple(shape):
        raise ValueError(f"{name}: got shape {list(array.shape)}, expected {list(shape)}")
    return array


def _places(scene: Any, what: str, name: str, given: Any) -> Floats:
    """Where the ends are, ``[k, 3]``."""
    if given is None:
        if scene is None:
            raise ValueError(f"{name}: expected places [k, 3], or a scene with {what}")
        devices = _attribute(scene, what)
        devices = devices.values() if isinstance(devices, Mapping) else devices
        given = [_plain(device.position).reshape(3) for device in devices]
    places = np.atleast_2d(np.asarray(given, dtype=np.float64))
    if places.ndim != 2 or places.shape[1] != 3:
        raise ValueError(f"{name}: got shape {list(places.shape)}, expected [k, 3]")
    return places


def _refused(met: list[int], kinds: Mapping[int, str], numbers: Sequence[float]) -> str | None:
    """Why a path is dropped: its kind, its order, or a number that is none."""
    for kind in met:
        if kind != 1:
            return kinds.get(kind, "other interaction")
    if len(met) > MAX_ORDER:
        return f"more than {MAX_ORDER} reflections"
    return None if np.isfinite(np.asarray(numbers, dtype=np.float64)).all() else "not finite"


def _agree(tx: Floats, rx: Floats, vertices: Floats, angles: Sequence[float]) -> bool:
    """Whether a path arrives from its last vertex and leaves for its first one, or for the other end if it has none.

    To a tenth of the way there, which is far more than rounding, and 1 cm, for vertices next to an end.
    """
    there = vertices[[-1, 0]] if len(vertices) else np.array([tx, rx], dtype=np.float64)
    ways = there - np.array([rx, tx], dtype=np.float64)
    lengths = np.linalg.norm(ways, axis=1)
    pointed = lengths[:, None] * _unit(np.array(angles[::2]), np.array(angles[1::2]))
    return bool((np.linalg.norm(pointed - ways, axis=1) <= 0.1 * lengths + 0.01).all())


def _row(numbers: Sequence[float], gain: complex, vertices: NDArray[Any]) -> dict[str, Any]:
    delay_s, *angles = (float(x) for x in numbers)
    nowhere = np.full(3, np.nan)
    return {
        "order": len(vertices),
        "c_tau_m": delay_s * SPEED_OF_LIGHT_M_PER_S,
        "aoa_rad": angles[:2],
        "aod_rad": angles[2:],
        "gain": complex(gain),
        "first": vertices[0] if len(vertices) else nowhere,
        "last": vertices[-1] if len(vertices) else nowhere,
    }


def _link(tx: Floats, rx: Floats, rows: list[dict[str, Any]]) -> Link:
    """A link of paths, strongest first."""
    rows.sort(key=lambda row: -abs(row["gain"]))
    column = lambda key, width: np.array([row[key] for row in rows], dtype=np.float64).reshape(len(rows), *width)  # noqa: E731
    return Link(
        tx_m=np.asarray(tx, dtype=np.float64),
        rx_m=np.asarray(rx, dtype=np.float64),
        order=np.array([row["order"] for row in rows], dtype=np.int64),
        c_tau_m=column("c_tau_m", ()),
        aoa_rad=column("aoa_rad", (2,)),
        aod_rad=column("aod_rad", (2,)),
        gain=np.array([row["gain"] for row in rows], dtype=np.complex128),
        first_vertex_m=column("first", (3,)),
        last_vertex_m=column("last", (3,)),
    )
