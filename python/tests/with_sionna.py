"""The bridge against Sionna RT itself, which traces the same scene as this package's tracer: 1 mm, 1e-4 rad, 0.1 dB.

Not among the tests that are always run: Sionna RT is large. Where it is installed:

    python -m pytest -s python/tests/with_sionna.py
"""

import json

import numpy as np
import sionna.rt as rt

import cslam

#: Half spaces: a slab so thick and lossy that nothing comes back from behind.
PERMITTIVITY, CONDUCTIVITY_S_PER_M, THICKNESS_M = 5.0, 1.0, 10.0
TX_M = [[-30.0, 1.0, 3.0], [5.0, -2.0, 1.5]]
RX_M = [[12.0, 3.0, 10.0], [28.0, -4.0, 8.0], [40.0, 1.0, 14.0]]
CARRIER_HZ = 30e9
MAX_ORDER = 2


def street():
    """The scene `simple_street_canyon`, of one material."""
    scene = rt.load_scene(rt.scene.simple_street_canyon, merge_shapes=False)
    scene.frequency = CARRIER_HZ
    scene.tx_array = scene.rx_array = rt.PlanarArray(num_rows=1, num_cols=1, pattern="hw_dipole", polarization="V")
    material = rt.RadioMaterial(
        "half-space", thickness=THICKNESS_M, relative_permittivity=PERMITTIVITY, conductivity=CONDUCTIVITY_S_PER_M
    )
    for thing in scene.objects.values():
        thing.radio_material = material
    for kind, name, places in ((rt.Transmitter, "gmt", TX_M), (rt.Receiver, "uav", RX_M)):
        for k, place in enumerate(places):
            scene.add(kind(f"{name}{k}", position=place))
    return scene


def faces(scene):
    """The triangles of a scene, as those of a scene file: in that scene's meshes they are clockwise seen from free space."""
    listed = []
    for thing in scene.objects.values():
        places = np.array(thing.mi_mesh.vertex_positions_buffer(), np.float64).reshape(-1, 3)
        corners = np.array(thing.mi_mesh.faces_buffer(), np.int64).reshape(-1, 3)
        listed += [{"vertices": places[triangle[::-1]].tolist()} for triangle in corners]
    return listed


def test_links_are_those_of_the_tracer_in_the_same_scene(tmp_path):
    scene = street()
    paths = rt.PathSolver()(scene, max_depth=MAX_ORDER, synthetic_array=True, refraction=False)
    links, dropped = cslam.bridge.sionna(paths, scene)
    assert dropped.total == 0 and len(links) == len(TX_M) * len(RX_M)

    material = {"relative_permittivity": PERMITTIVITY, "conductivity_S_per_m": CONDUCTIVITY_S_PER_M, "model": "half-space"}
    described = {"name": "street", "units": "metre", "material": material, "frequency_hz": CARRIER_HZ, "faces": faces(scene)}
    file = tmp_path / "street.json"
    file.write_text(json.dumps(described))
    truth = cslam.Scene(str(file)).trace(TX_M, RX_M, max_order=MAX_ORDER)

    compared = 0
    for link, true in zip(links, truth):
        np.testing.assert_allclose((link.tx_m, link.rx_m), (true.tx_m, true.rx_m), atol=1e-6)
        # Shooting rays may miss a path of several reflections, but never of one.
        assert (link.order < 2).sum() == (true.order < 2).sum()
        for p in range(len(link)):
            same = np.argmin(
                np.abs(true.c_tau_m - link.c_tau_m[p]) + np.linalg.norm(true.aoa_world - link.aoa_world[p], axis=1)
            )
            assert link.order[p] == true.order[same]
            np.testing.assert_allclose(link.c_tau_m[p], true.c_tau_m[same], atol=1e-3)
            np.testing.assert_allclose(link.aoa_world[p], true.aoa_world[same], atol=1e-4)
            np.testing.assert_allclose(link.aod_world[p], true.aod_world[same], atol=1e-4)
            np.testing.assert_allclose(link.gain_db[p], true.gain_db[same], atol=0.1)
            compared += 1
    print(f"{compared} paths of {len(links)} links agree")
    assert compared > 5 * len(links)
