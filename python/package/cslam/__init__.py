"""The receiver of a UAV that sees with radio, over NumPy arrays.

World axes are east, north, up; body axes forward, left, up; metres. A direction is a unit vector: of arrival from the UAV towards where
the wave comes from, of departure from the transmitter (GMT) towards where it goes. Lengths ``c_tau_m`` are the speed of light times the
delay. Quaternions are ``[w, x, y, z]``, body to world.

>>> import cslam
>>> print(cslam.demo())                                             # doctest: +SKIP
>>> link = cslam.Scene("outdoor").trace([0, 0, 1.5], [56, 2, 6])[0]
>>> sweep = cslam.synth(link)
>>> paths = cslam.Estimator().estimate(sweep.iq, sweep.beams, sweep.exponents)
>>> points = cslam.solve(paths, uav_m=link.rx_m, gmt_m=link.tx_m)

Each transmit beam has an exponent of its own (amplitude = integer x 2^exponent): one for a whole sweep gives paths that look right and
are wrong.
"""

from cslam import bridge
from cslam._cslam import __version__
from cslam.bridge import Dropped
from cslam.estimation import Estimator, Paths, quantize
from cslam.events import BarometerSample, Beacon, ImuSamples, MagnetometerSample, SweepSamples, TimingExchange
from cslam.files import Flight, Recording, Smoothed, fly, read_links, read_packets, read_sigmf, write_links, write_sigmf
from cslam.receiver import Pose, Receiver, Swept
from cslam.recorded import RecordedFlight, record
from cslam.solving import Points, classify, solve
from cslam.world import Link, Scene, demo, synth

__all__ = [
    "BarometerSample",
    "Beacon",
    "Dropped",
    "Estimator",
    "Flight",
    "ImuSamples",
    "Link",
    "MagnetometerSample",
    "Paths",
    "Points",
    "Pose",
    "Receiver",
    "RecordedFlight",
    "Recording",
    "Scene",
    "Smoothed",
    "SweepSamples",
    "Swept",
    "TimingExchange",
    "__version__",
    "bridge",
    "classify",
    "demo",
    "fly",
    "quantize",
    "read_links",
    "read_packets",
    "read_sigmf",
    "record",
    "solve",
    "synth",
    "write_links",
    "write_sigmf",
]
