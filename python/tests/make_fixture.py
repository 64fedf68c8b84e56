"""Makes the stored fixture of the bridges out of this package's own tracer, in the layout of Sionna RT's arrays (float32, as there).

``python tests/make_fixture.py`` writes ``tests/links.npz``. A path of each kind that is dropped is put in beside the traced ones. Vertices
between the first and the last one are not in a link; the bridges read only these two.
"""

from pathlib import Path

import numpy as np

import cslam

TX = [[0.0, 0.0, 1.5], [55.0, 60.0, 2.0]]
RX = [[56.0, 2.0, 6.0], [50.0, 8.0, 12.0], [20.0, 10.0, 12.0]]
DEPTH = 4


def main() -> None:
    """Writes the file."""
    links = cslam.Scene("outdoor").trace(TX, RX)
    count = max(len(link) for link in links) + 4
    shape = (len(RX), len(TX), count)
    real = {name: np.zeros(shape, np.float32) for name in ("tau", "theta_t", "phi_t", "theta_r", "phi_r", "re", "im")}
    valid = np.zeros(shape, bool)
    interactions = np.zeros((DEPTH, *shape), np.uint32)
    vertices = np.zeros((DEPTH, *shape, 3), np.float32)
    for index, link in enumerate(links):
        t, r = divmod(index, len(RX))
        # Not in the order of their strength: that is the bridge's work.
        for p, i in enumerate(reversed(range(len(link)))):
            order = int(link.order[i])
            valid[r, t, p] = True
            real["tau"][r, t, p] = link.c_tau_m[i] / 299_792_458.0
            real["theta_r"][r, t, p], real["phi_r"][r, t, p] = link.aoa_rad[i]
            real["theta_t"][r, t, p], real["phi_t"][r, t, p] = link.aod_rad[i]
            real["re"][r, t, p], real["im"][r, t, p] = link.gain[i].real, link.gain[i].imag
            interactions[:order, r, t, p] = 1
            if order:
                vertices[0, r, t, p] = link.first_vertex_m[i]
                vertices[order - 1, r, t, p] = link.last_vertex_m[i]
    # Kinds that are dropped: diffuse, refraction, diffraction, and four reflections, at the end of the first pair.
    for p, kinds in enumerate([[2], [4], [1, 8], [1, 1, 1, 1]], start=count - 4):
        valid[0, 0, p] = True
        real["tau"][0, 0, p], real["re"][0, 0, p] = 2e-7, 1e-7
        real["theta_r"][0, 0, p] = real["theta_t"][0, 0, p] = 1.5
        interactions[: len(kinds), 0, 0, p] = kinds
    file = Path(__file__).parent / "links.npz"
    np.savez_compressed(file, tx=TX, rx=RX, valid=valid, interactions=interactions, vertices=vertices, **real)
    print(f"{file}: {file.stat().st_size} bytes")


if __name__ == "__main__":
    main()
