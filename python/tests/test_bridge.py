"""The bridges against this package's own tracer: 1 mm, 1e-4 rad, 0.1 dB."""

import types
from pathlib import Path

import numpy as np
import pytest

import cslam

CARRIER_HZ = 30e9
FIXTURE = np.load(Path(__file__).parent / "links.npz", allow_pickle=False)


def as_sionna(**changes):
    """The fixture as Sionna RT's `Paths`, and its scene."""
    a = tuple(FIXTURE[part][:, None, :, None, :] for part in ("re", "im"))
    names = ("tau", "theta_t", "phi_t", "theta_r", "phi_r", "valid", "interactions", "vertices")
    paths = types.SimpleNamespace(a=a, **{name: FIXTURE[name] for name in names})
    for name, value in changes.items():
        setattr(paths, name, value)
    devices = lambda places: {f"d{i}": types.SimpleNamespace(position=p) for i, p in enumerate(places)}  # noqa: E731
    scene = types.SimpleNamespace(transmitters=devices(FIXTURE["tx"]), receivers=devices(FIXTURE["rx"]))
    return paths, scene


def as_deepmimo():
    """The links of the first transmitter as a DeepMIMO data set: float32, degrees, NaN where there is no path, or no interaction."""
    absent = ~FIXTURE["valid"][:, 0]
    gain = FIXTURE["re"][:, 0].astype(complex) + 1j * FIXTURE["im"][:, 0]
    digits = {0: "", 1: "1", 2: "3", 4: "4", 8: "2"}
    kinds = FIXTURE["interactions"][:, :, 0]
    inter = [[float("".join(digits[int(k)] for k in kinds[:, u, p]) or 0) for p in range(kinds.shape[2])] for u in range(kinds.shape[1])]
    with np.errstate(divide="ignore"):
        fields = {
            "delay": FIXTURE["tau"][:, 0],
            "power": 20 * np.log10(np.abs(gain)),
            "phase": np.degrees(np.angle(gain)),
            "aoa_el": np.degrees(FIXTURE["theta_r"][:, 0]),
            "aoa_az": np.degrees(FIXTURE["phi_r"][:, 0]),
            "aod_el": np.degrees(FIXTURE["theta_t"][:, 0]),
            "aod_az": np.degrees(FIXTURE["phi_t"][:, 0]),
            "inter": np.array(inter),
        }
    fields = {name: np.where(absent, np.nan, values).astype(np.float32) for name, values in fields.items()}
    places = np.moveaxis(np.where(kinds[..., None] == 0, np.nan, FIXTURE["vertices"][:, :, 0]), 0, 2).astype(np.float32)
    ends = {"tx_pos": FIXTURE["tx"][:1].astype(np.float32), "rx_pos": FIXTURE["rx"].astype(np.float32)}
    return {**ends, "inter_pos": places, **fields, "rt_params": {"frequency": CARRIER_HZ}}


def check(links, truth):
    """The links are those of the tracer."""
    assert len(links) == len(truth)
    for link, true in zip(links, truth):
        np.testing.assert_array_equal(link.order, true.order)
        np.testing.assert_allclose(link.tx_m, true.tx_m, atol=1e-6)
        np.testing.assert_allclose(link.rx_m, true.rx_m, atol=1e-6)
        np.testing.assert_allclose(link.c_tau_m, true.c_tau_m, atol=1e-3)
        for got, want in ((link.aoa_world, true.aoa_world), (link.aod_world, true.aod_world)):
            np.testing.assert_allclose(got, want, atol=1e-4)
        np.testing.assert_allclose(link.gain_db, true.gain_db, atol=0.1)
        np.testing.assert_allclose(np.angle(link.gain / true.gain), 0, atol=1e-3)
        np.testing.assert_allclose(link.first_vertex_m, true.first_vertex_m, atol=1e-4)
        np.testing.assert_allclose(link.last_vertex_m, true.last_vertex_m, atol=1e-4)


@pytest.fixture(scope="module")
def truth():
    return cslam.Scene("outdoor").trace(FIXTURE["tx"], FIXTURE["rx"])


def test_links_of_sionna_are_those_of_the_tracer(truth):
    links, dropped = cslam.bridge.sionna(*as_sionna())
    check(links, truth)
    assert dropped == {"diffuse": 1, "refraction": 1, "diffraction": 1, "more than 3 reflections": 1}
    assert dropped.total == 4
    places, _ = as_sionna()
    again, _ = cslam.bridge.sionna(places, tx_m=FIXTURE["tx"], rx_m=FIXTURE["rx"])
    assert [link.to_json() for link in again] == [link.to_json() for link in links]


def test_links_of_deepmimo_are_those_of_the_tracer(truth):
    links, dropped = cslam.bridge.deepmimo(as_deepmimo())
    check(links, truth[: len(links)])
    assert dropped == {"scattering": 1, "transmission": 1, "diffraction": 1, "more than 3 reflections": 1}


@pytest.mark.parametrize(
    "digits, reason",
    [(2, "diffraction"), (13, "scattering"), (4, "transmission"), (1111, "more than 3 reflections"), (15, "other interaction")],
)
def test_interactions_of_deepmimo_are_dropped_by_their_digits(digits, reason):
    others = as_deepmimo()
    present = np.isfinite(others["inter"])
    others["inter"][present] = digits
    links, dropped = cslam.bridge.deepmimo(others)
    assert dropped == {reason: present.sum()} and all(len(link) == 0 for link in links)


def test_phases_of_deepmimo_that_hold_the_way_lose_it(truth):
    held = as_deepmimo()
    held["phase"] = held["phase"] - 360 * CARRIER_HZ * held["delay"].astype(np.float64)
    links, _ = cslam.bridge.deepmimo(held, phase_at_receiver=True)
    check(links, truth[: len(links)])


def test_angles_of_deepmimo_of_other_conventions_are_dropped():
    good = as_deepmimo()
    count = sum(len(link) for link in cslam.bridge.deepmimo(good)[0])
    elevations = {name: 90 - good[name] for name in ("aoa_el", "aod_el")}
    travel = {"aoa_el": 180 - good["aoa_el"], "aoa_az": good["aoa_az"] + 180}
    # So does the converter of Aerial Omniverse Digital Twin in DeepMIMO 4.0.5: elevations, and arrivals along the way of travel.
    both = {**elevations, "aoa_el": 90 - travel["aoa_el"], "aoa_az": travel["aoa_az"]}
    for angles in (elevations, travel, both):
        links, dropped = cslam.bridge.deepmimo({**good, **angles})
        assert sum(len(link) for link in links) == 0
        assert dropped["angles and places disagree"] == count


def test_a_deepmimo_set_of_several_base_stations_is_refused():
    # Its fields are lists, one entry for each base station.
    both = {name: [value, value] for name, value in as_deepmimo().items()}
    with pytest.raises(ValueError, match="tx_pos: got 2 places, expected one"):
        cslam.bridge.deepmimo(both)


def test_what_is_no_number_is_counted():
    broken = FIXTURE["tau"].copy()
    broken[1, 0, 0] = np.nan
    _, dropped = cslam.bridge.sionna(*as_sionna(tau=broken))
    assert dropped["not finite"] == 1
    nowhere = as_deepmimo()
    nowhere["inter_pos"] = np.full_like(nowhere["inter_pos"], np.nan)
    links, dropped = cslam.bridge.deepmimo(nowhere)
    assert dropped["not finite"] > 0 and all((link.order == 0).all() for link in links)


def test_a_link_of_another_tracer_is_heard_and_solved():
    links, _ = cslam.bridge.sionna(*as_sionna())
    heard = cslam.synth(links[0], impairments=False)
    paths = cslam.Estimator().estimate(heard.iq, heard.beams, heard.exponents)
    assert len(paths) > 0
    for length, aoa in zip(paths.c_tau_m, paths.aoa_body):
        # Without the error budget, what is left is noise, and paths that are not told apart.
        assert np.min(np.abs(links[0].c_tau_m - length)) < 0.15
        assert np.max(links[0].aoa_world @ aoa) > np.cos(np.radians(10))
    points = cslam.solve(links[0], open_gates=True)
    first = links[0].order == 1
    np.testing.assert_allclose(points.position_m[first], links[0].last_vertex_m[first], atol=1e-3)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"tau": FIXTURE["tau"][0]}, "tau: got shape"),
        ({"phi_r": FIXTURE["phi_r"][:, :, :1]}, "phi_r: got shape"),
        ({"a": FIXTURE["re"]}, "a: expected a pair"),
        ({"a": (FIXTURE["re"], FIXTURE["im"])}, "a, real part: got shape"),
    ],
)
def test_other_layouts_are_refused_by_name(changes, words):
    with pytest.raises(ValueError, match=words):
        cslam.bridge.sionna(*as_sionna(**changes))
    with pytest.raises(ValueError, match="vertices: expected an attribute"):
        paths, scene = as_sionna()
        del paths.vertices
        cslam.bridge.sionna(paths, scene)
