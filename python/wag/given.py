"""What callers give: checked where it comes in, and refused by name."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
import numpy.typing as npt

from ._wag import InputError

Floats = npt.NDArray[np.float64]


def numbers(name: str, value: npt.ArrayLike, *shapes: tuple[int | None, ...]) -> Floats:
    """An array of one of these shapes, None standing for any length."""
    try:
        found = np.ascontiguousarray(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"`{name}` is no array of numbers: {error}") from error
    for shape in shapes:
        fits = (want is None or want == have for want, have in zip(shape, found.shape))
        if len(shape) == found.ndim and all(fits):
            return found
    needed = " or ".join(str(tuple("n" if x is None else x for x in s)) for s in shapes)
    raise InputError(f"`{name}` has the shape {found.shape}, but needs {needed}".replace("'", ""))


def whole(name: str, value: Any, least: int, most: int = 2**63 - 1) -> int:
    """A whole number within these bounds."""
    try:
        found = operator.index(value)
    except TypeError as error:
        raise InputError(f"`{name}` is {value!r}, but must be a whole number") from error
    if not least <= found <= most:
        raise InputError(f"`{name}` is {found}, but must be from {least} to {most}")
    return found


def positive(name: str, value: Any) -> float:
    """A finite number above 0."""
    found = number(name, value)
    if found <= 0.0:
        raise InputError(f"`{name}` is {found}, but must be above 0")
    return found


def number(name: str, value: Any) -> float:
    """A finite number."""
    try:
        found = float(value)
    except (TypeError, ValueError) as error:
        raise InputError(f"`{name}` is {value!r}, but must be a number") from error
    if not np.isfinite(found):
        raise InputError(f"`{name}` is {found}, but must be finite")
    return found
