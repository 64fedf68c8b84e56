"""The examples, with what they import from elsewhere replaced: Sionna RT is no part of the tests."""

import contextlib
import io
import json
import runpy
import sys
import types
from pathlib import Path

import matplotlib
import numpy as np

import cslam

EXAMPLES = Path(__file__).parents[1] / "examples"


class FreeSpace:
    """A scene of Sionna RT with nothing in it: two devices, and the straight way between them."""

    def __init__(self):
        self.transmitters, self.receivers = {}, {}

    def add(self, device):
        devices = self.transmitters if device.kind == "tx" else self.receivers
        devices[device.name] = device

    def get(self, name):
        return {**self.transmitters, **self.receivers}[name]

    def paths(self, **_options):
        (tx,), (rx,) = self.transmitters.values(), self.receivers.values()
        way = np.subtract(rx.position, tx.position)
        length = np.linalg.norm(way)
        one = lambda value: np.full((1, 1, 1), value)  # noqa: E731
        zenith, azimuth = np.arccos(way[2] / length), np.arctan2(way[1], way[0])
        return types.SimpleNamespace(
            tau=one(length / 299_792_458.0),
            theta_t=one(zenith), phi_t=one(azimuth),
            theta_r=one(np.pi - zenith), phi_r=one(azimuth + np.pi),
            valid=one(True),
            a=(np.full((1, 1, 1, 1, 1), 1e-5), np.zeros((1, 1, 1, 1, 1))),
            interactions=np.zeros((1, 1, 1, 1), dtype=np.uint32),
            vertices=np.zeros((1, 1, 1, 1, 3)),
        )  # fmt: skip


def device(kind):
    return lambda name, position: types.SimpleNamespace(kind=kind, name=name, position=position)


def test_a_route_through_a_scene_is_a_link_a_sweep_and_can_be_flown(monkeypatch, tmp_path):
    rt = types.ModuleType("sionna.rt")
    rt.scene = types.SimpleNamespace(simple_street_canyon="street")
    rt.load_scene = lambda _name: FreeSpace()
    rt.PlanarArray = lambda **_options: None
    rt.Transmitter, rt.Receiver = device("tx"), device("rx")
    rt.PathSolver = lambda: lambda scene, **options: scene.paths(**options)
    sionna = types.ModuleType("sionna")
    sionna.rt = rt
    monkeypatch.setitem(sys.modules, "sionna", sionna)
    monkeypatch.setitem(sys.modules, "sionna.rt", rt)
    out = tmp_path / "world.jsonl"
    monkeypatch.setattr(sys, "argv", ["sionna_route.py", str(out)])
    runpy.run_path(str(EXAMPLES / "sionna_route.py"), run_name="__main__")

    links = cslam.read_links(out)
    assert len(links) == 181 and all(link.order.tolist() == [0] for link in links)
    for ends in ([link.tx_m for link in links], [link.rx_m for link in links]):
        steps = np.diff(np.array(ends), axis=0)
        # The first and last half second from rest: the UAV of `cslam fly --channel` takes no abrupt start.
        assert np.linalg.norm(steps[[0, -1]], axis=1).max() < 0.01
        # m/s, and m/s^2.
        assert np.linalg.norm(steps, axis=1).max() / 0.5 < 8
        assert np.linalg.norm(np.diff(steps, axis=0), axis=1).max() / 0.25 < 3


def test_the_notebook_prints_what_it_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    notebook = json.loads((EXAMPLES / "first_map.ipynb").read_text())
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(cells) > 5
    names = {}
    for cell in cells:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec("".join(cell["source"]), names)
        shown = "".join("".join(output.get("text", "")) for output in cell["outputs"])
        assert printed.getvalue() == shown
        figures = names["plt"].get_fignums()
        assert len(figures) == sum("image/png" in output.get("data", {}) for output in cell["outputs"])
        names["plt"].close("all")
