"""Arrays of the caller's, checked: a ValueError says what was met and what was wanted."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
#: A coordinate, rate or field beyond this is no measurement.
MOST = 1e7


def dense(array: NDArray[Any], dtype: Any = None) -> NDArray[Any]:
    """The array as the receiver reads it: C-contiguous and aligned, a copy where it was not."""
    return np.require(array, dtype, ["C", "A"])


def floats(name: str, value: Any, shape: tuple[int | None, ...]) -> Floats:
    """``value`` as a C-contiguous float64 array of a shape; None stands for any length."""
    try:
        array = dense(np.asarray(value), np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: expected numbers of shape {wanted(shape)}: {error}") from None
    return checked(name, array, shape)


def integers(name: str, value: Any, dtype: Any, shape: tuple[int | None, ...]) -> NDArray[Any]:
    """``value``, whole numbers that fit, as a C-contiguous array of ``dtype``."""
    array = np.asarray(value)
    if array.dtype.kind not in "iu":
        raise ValueError(f"{name}: got {array.dtype}, expected whole numbers")
    limits = np.iinfo(dtype)
    if array.size and (array.min() < limits.min or array.max() > limits.max):
        raise ValueError(f"{name}: got {array.min()} to {array.max()}, expected {limits.min} to {limits.max}")
    return checked(name, dense(array, dtype), shape)


def checked(name: str, array: NDArray[Any], shape: tuple[int | None, ...]) -> NDArray[Any]:
    """The array, of the right shape."""
    fits = array.ndim == len(shape) and all(want in (None, got) for want, got in zip(shape, array.shape))
    if not fits:
        raise ValueError(f"{name}: got shape {list(array.shape)}, expected {wanted(shape)}")
    return array


def wanted(shape: tuple[int | None, ...]) -> str:
    """A shape in words."""
    return "[" + ", ".join("n" if length is None else str(length) for length in shape) + "]"


def finite(name: str, array: Floats) -> Floats:
    """The array, of numbers."""
    if not (np.abs(array) < MOST).all():
        raise ValueError(f"{name}: a number is not finite, or beyond {MOST:g}")
    return array


def three(name: str, value: Any) -> list[float]:
    """A vector."""
    return finite(name, floats(name, value, (3,))).tolist()


def within(name: str, value: float, least: float, most: float) -> None:
    """Refuses a number out of its range."""
    if not least <= value <= most:
        raise ValueError(f"{name}: got {value}, expected {least:g} to {most:g}")


def whole(name: str, value: Any, least: int, most: int) -> int:
    """A whole number in its range."""
    try:
        number = value.__index__()
    except AttributeError:
        raise ValueError(f"{name}: got {type(value).__name__}, expected a whole number") from None
    if not least <= number <= most:
        raise ValueError(f"{name}: got {number}, expected {least} to {most}")
    return number


def time_of(time_ns: Any) -> int:
    """Nanoseconds of a clock."""
    return whole("time_ns", time_ns, 0, 2**64 - 1)
