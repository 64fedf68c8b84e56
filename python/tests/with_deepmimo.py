"""The bridge of DeepMIMO against that of Sionna RT: 1 mm, 1e-4 rad, 0.1 dB, for paths that DeepMIMO exports, converts and loads.

Not among the tests that are always run: both packages are large, and DeepMIMO holds NumPy below 2.3. Where they are installed:

    python -m pytest -s python/tests/with_deepmimo.py
"""

import contextlib
import io

import numpy as np
import pytest

rt = pytest.importorskip("sionna.rt", reason="needs Sionna RT: pip install sionna-rt")
deepmimo = pytest.importorskip("deepmimo", reason="needs DeepMIMO: pip install deepmimo")

from deepmimo.exporters.sionna_exporter import export_paths, sionna_exporter  # noqa: E402
from with_sionna import RX_M, TX_M, street  # noqa: E402

import cslam  # noqa: E402

TRACED = {"max_depth": 3, "synthetic_array": True, "refraction": False}


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """DeepMIMO writes into the working directory, and finds sets nowhere else."""
    monkeypatch.chdir(tmp_path)


def data_sets(scene, exported):
    """DeepMIMO's sets of these paths, one for each base station."""
    # It says much, among which the line of this test would be lost.
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        sionna_exporter(scene, exported, TRACED, "exported")
        # Without these two it asks a question if the set is there already, and opens a window.
        name = deepmimo.convert("exported", scenario_name="street", overwrite=True, vis_scene=False)
        return deepmimo.load(name)


def compare(sets, truth, *, phase_at_receiver, phase_rad):
    """How many paths of the sets are those of the links."""
    links = []
    for one in sets.datasets:
        of_one, dropped = cslam.bridge.deepmimo(one, phase_at_receiver=phase_at_receiver)
        assert dropped.total == 0
        links += of_one
    assert len(links) == len(truth)
    for link in links:
        (true,) = [true for true in truth if np.allclose((link.tx_m, link.rx_m), (true.tx_m, true.rx_m), atol=1e-5)]
        apart = np.abs(link.c_tau_m[:, None] - true.c_tau_m) + np.linalg.norm(link.aoa_world[:, None] - true.aoa_world, axis=2)
        same = apart.argmin(axis=1)
        # As many paths, and each another one.
        assert sorted(same) == list(range(len(true)))
        np.testing.assert_array_equal(link.order, true.order[same])
        np.testing.assert_allclose(link.c_tau_m, true.c_tau_m[same], atol=1e-3)
        np.testing.assert_allclose(link.aoa_world, true.aoa_world[same], atol=1e-4)
        np.testing.assert_allclose(link.aod_world, true.aod_world[same], atol=1e-4)
        np.testing.assert_allclose(link.gain_db, true.gain_db[same], atol=0.1)
        np.testing.assert_allclose(np.angle(link.gain / true.gain[same]), 0, atol=phase_rad)
        np.testing.assert_allclose(link.first_vertex_m, true.first_vertex_m[same], atol=1e-3)
        np.testing.assert_allclose(link.last_vertex_m, true.last_vertex_m[same], atol=1e-3)
    return sum(len(link) for link in links)


def test_links_of_a_set_are_those_of_the_paths_it_was_made_of():
    scene = street()
    paths = rt.PathSolver()(scene, **TRACED)
    truth, _ = cslam.bridge.sionna(paths, scene)
    assert len(truth) == len(TX_M) * len(RX_M)
    # The converter keeps the first so many in the tracer's order, though stronger ones may come later.
    assert max(len(true) for true in truth) <= deepmimo.consts.MAX_PATHS

    sets = data_sets(scene, paths)
    compared = compare(sets, truth, phase_at_receiver=False, phase_rad=1e-4)
    with pytest.raises(ValueError, match=f"tx_pos: got {len(TX_M)} places"):
        cslam.bridge.deepmimo(sets)

    # The same with the way in the phases. Sionna RT computes them with float32, which rounds ten thousand periods to 0.004 rad.
    held = export_paths(paths)
    held[0]["a"] = paths.cir(normalize_delays=False, out_type="numpy")[0][..., 0]
    assert compare(data_sets(scene, held), truth, phase_at_receiver=True, phase_rad=0.02) == compared

    print(f"{compared} paths of {len(truth)} links agree")
    assert compared > 5 * len(truth) and max(true.order.max() for true in truth) == 3


def test_other_interactions_are_dropped_by_their_names():
    scene = street()
    for thing in scene.objects.values():
        thing.radio_material.scattering_coefficient = 0.4
    for more, name in (({"diffraction": True}, "diffraction"), ({"diffuse_reflection": True, "samples_per_src": 2000}, "scattering")):
        one = data_sets(scene, rt.PathSolver()(scene, **TRACED, **more)).datasets[0]
        links, dropped = cslam.bridge.deepmimo(one)
        assert set(dropped) == {name}
        assert dropped.total + sum(len(link) for link in links) == np.isfinite(one.delay).sum()
