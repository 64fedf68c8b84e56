"""Links along a route through a scene of Sionna RT, one a sweep, for `cslam fly --channel`.

    pip install sionna-rt
    python python/examples/sionna_route.py world.jsonl
    cslam fly --channel world.jsonl

The transmitter drives along a street of the scene `simple_street_canyon`, ahead of which the UAV flies to and fro. It has to move: only
sweeps from several of its places tell a wall from an image of one, so that no surface is confirmed by a transmitter that stands still.
"""

import argparse
import sys
from collections import Counter

import numpy as np
import sionna.rt as rt

import cslam

SWEEP_S = 0.5


def route(duration_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Places of transmitter and UAV, each ``[n, 3]``, m: both begin and end at rest, as a route that is flown has to."""
    share = np.arange(0.0, duration_s + 1e-9, SWEEP_S) / duration_s
    gone = share - np.sin(2 * np.pi * share) / (2 * np.pi)
    along = 10 + 30 * (1 - np.cos(2 * np.pi * gone)) / 2
    across = 4 * np.sin(6 * np.pi * gone)
    up = 8 + 4 * np.sin(np.pi * gone) ** 2 + 2 * np.sin(4 * np.pi * gone) ** 2
    uav = np.stack([along, across, up], axis=1)
    gmt = np.stack([-45 + 35 * gone, 2 * np.sin(2 * np.pi * gone), np.full_like(gone, 3.0)], axis=1)
    return gmt, uav


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("out", help="path list to write (.jsonl)")
    arguments.add_argument("--duration", type=float, default=90.0, help="length of the route, s (default: 90)")
    given = arguments.parse_args()

    scene = rt.load_scene(rt.scene.simple_street_canyon)
    scene.frequency = 30e9
    dipole = rt.PlanarArray(num_rows=1, num_cols=1, pattern="hw_dipole", polarization="V")
    scene.tx_array = scene.rx_array = dipole
    scene.add(rt.Transmitter("gmt", position=[0.0, 0.0, 0.0]))
    scene.add(rt.Receiver("uav", position=[0.0, 0.0, 0.0]))
    solver, links, dropped = rt.PathSolver(), [], Counter()
    for gmt, uav in zip(*route(given.duration)):
        scene.get("gmt").position = gmt.tolist()
        scene.get("uav").position = uav.tolist()
        paths = solver(scene, max_depth=3, synthetic_array=True, refraction=False)
        (link,), left_out = cslam.bridge.sionna(paths, scene)
        links.append(link)
        dropped.update(left_out)
        if sys.stderr.isatty():
            print(f"\r{len(links)} places", end="", file=sys.stderr, flush=True)
    cslam.write_links(given.out, links)
    heard = np.mean([len(link) for link in links])
    if sys.stderr.isatty():
        print(file=sys.stderr)
    print(f"{given.out}: {len(links)} links, {heard:.1f} paths a link; dropped: {dict(dropped) or 'none'}")


if __name__ == "__main__":
    main()
