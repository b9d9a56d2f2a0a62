"""Ropes: nine parameters, and what some have beyond them."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Sequence
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from . import _wag
from .given import Floats, numbers, whole


class Parameter(NamedTuple):
    """One of a rope's nine parameters, and the range in which ropes are identified."""

    key: str
    label: str
    unit: str
    min: float
    max: float


PARAMETERS: tuple[Parameter, ...] = tuple(Parameter(*p) for p in _wag.parameters())
"""The parameters in the order of every array of them."""


PARAMETERS_KEYS = tuple(p.key for p in PARAMETERS)


@dataclasses.dataclass(frozen=True)
class Rope:
    """A rope: rigid links with ball joints, and a lead at its free end.

    The fields are the keys of ``rope.toml``.
    """

    links: int
    """Number of rigid links."""
    length_m: float
    """Clamp to lead's centre."""
    joint_damping_nms_per_rad: float
    joint_stiffness_nm_per_rad: float
    radius_m: float
    mass_per_length_kg_per_m: float
    lead_mass_kg: float
    lead_radius_m: float
    link_extra_scale: float
    """Scale of a link's inertia radius."""
    extras: dict[str, Any] | None = None
    """Air drag, rest curvature, uneven mass, friction, clamp: the table ``extras`` of ``rope.toml``."""

    @classmethod
    def random(cls, seed: int) -> Rope:
        """A rope drawn from the ranges of :data:`PARAMETERS`."""
        return cls.from_array(_wag.random_rope(whole("seed", seed, 0)))

    @classmethod
    def from_array(cls, parameters: npt.ArrayLike) -> Rope:
        """From nine numbers in the order of :data:`PARAMETERS`; links are rounded."""
        found = numbers("parameters", parameters, (len(PARAMETERS),))
        if not np.isfinite(found).all():
            raise _wag.InputError(f"`parameters` must be finite, found {found}")
        links, *others = found.tolist()
        return cls(round(links), *others)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Rope:
        """Reads a rope file."""
        return cls(**json.loads(_wag.read_rope(path))["rope"])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a rope file, whole or not at all."""
        _wag.write_rope(path, self.to_json())

    def array(self) -> Floats:
        """The nine parameters, without the extras."""
        values = [getattr(self, key) for key in PARAMETERS_KEYS]
        return numbers("rope", values, (len(PARAMETERS),))

    def to_json(self) -> str:
        kept: dict[str, Any] = dict(zip(PARAMETERS_KEYS, self.array().tolist(), strict=True))
        return json.dumps(kept | {"links": whole("links", self.links, 1), "extras": self.extras})


def tabled(ropes: Rope | Sequence[Rope] | npt.ArrayLike) -> tuple[Floats, list[str | None]]:
    """Ropes as a table of shape (ropes, 9), and the extras of those that have any."""
    if isinstance(ropes, Rope):
        ropes = [ropes]
    listed = [rope for rope in ropes if isinstance(rope, Rope)] if isinstance(ropes, Sequence) else []
    if isinstance(ropes, Sequence) and len(listed) == len(ropes):
        table = np.array([rope.array() for rope in listed]).reshape(-1, len(PARAMETERS))
        extras = [json.dumps(rope.extras) if rope.extras else None for rope in listed]
        return table, extras if any(extras) else []
    table = numbers("ropes", cast(npt.ArrayLike, ropes), (None, len(PARAMETERS)), (len(PARAMETERS),))
    return np.atleast_2d(table), []


def random_target(seed: int) -> Floats:
    """A target of a strike, (3,) in m, that every rope of the ranges reaches."""
    return np.array(_wag.random_target(whole("seed", seed, 0)))
