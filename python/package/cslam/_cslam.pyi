"""The compiled half. Private: its arrays must be C-contiguous and of exactly these types."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str

_Samples = tuple[NDArray[np.int16], NDArray[np.uint16], NDArray[np.int32]]

class Estimator:
    def __new__(
        cls,
        mode: str,
        gmt_heading_rad: float,
        false_alarms_per_sweep: float,
        dynamic_range_db: float,
        screening: bool,
        follow: bool,
    ) -> Estimator: ...
    def estimate(
        self, iq: NDArray[np.int16], beams: NDArray[np.uint16], exponents: NDArray[np.int32]
    ) -> tuple[Any, ...]: ...

class Scene:
    name: str
    frequency_hz: float
    bounds_m: list[list[float]]
    faces: int
    def __new__(cls, name: str) -> Scene: ...
    def trace(self, tx_m: NDArray[np.float64], rx_m: NDArray[np.float64], max_order: int) -> list[str]: ...

def solve(paths: dict[str, Any], gates: dict[str, Any]) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str]]: ...
def classify(paths: dict[str, Any]) -> NDArray[np.float64]: ...
def synth(link: str, seed: int, snr_offset_db: float, impairments: bool, attitude_wxyz: list[float]) -> _Samples: ...
def read_sigmf(name: str) -> tuple[_Samples, str, list[float] | None, list[float] | None, list[float] | None]: ...
def write_sigmf(
    name: str,
    iq: NDArray[np.int16],
    beams: NDArray[np.uint16],
    exponents: NDArray[np.int32],
    gmt_position_m: list[float] | None,
    uav_position_m: list[float] | None,
    uav_quaternion_wb: list[float] | None,
) -> None: ...
def read_packets(file: str, keys: list[str], trust: str) -> str: ...
def fly(directory: str, out: str, steps: int | None) -> str: ...
