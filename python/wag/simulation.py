"""Simulated ropes: whole batches of motions, or step by step."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from . import _wag
from ._wag import Motion
from .given import Floats, number, numbers, whole
from .rope import Rope, tabled

THREADS = os.cpu_count() or 1


@dataclasses.dataclass(frozen=True, eq=False)
class Approach:
    """Where each rope's lead came nearest; NaN for a rope whose simulation diverged."""

    distance_m: Floats
    """(ropes,)"""
    time_s: Floats
    """(ropes,)"""
    tip_m: Floats
    """The lead's centre then, (ropes, 3)."""
    velocity_m_s: Floats
    """(ropes, 3)"""


@dataclasses.dataclass(frozen=True, eq=False)
class Simulation:
    """What was simulated; what was not asked for is None or empty."""

    diverged: npt.NDArray[np.bool_]
    """Ropes whose simulation blew up, even at a quarter of the step, (ropes,)."""
    rerun: npt.NDArray[np.bool_]
    """Ropes that were simulated again at a quarter of the step, (ropes,)."""
    peak_tip_speed_m_s: Floats
    nodes_m: list[npt.NDArray[np.floating]]
    """Of each rope (frames, links + 1, 3), clamp first; without a copy, NaN where it diverged.

    Without `rate_hz` there are no frames."""
    point: Approach | None = None
    segment: Approach | None = None
    highest_m: Floats | None = None
    """Highest place of each lead."""
    tip_height_spread_m: Floats | None = None
    """Within the rest window."""
    middle_movement_m: Floats | None = None
    """Within the rest window."""

    def tips_m(self) -> npt.NDArray[np.floating]:
        """The leads' centres, (ropes, frames, 3)."""
        if not self.nodes_m:
            return np.zeros((0, 0, 3))
        return np.stack([nodes[:, -1] for nodes in self.nodes_m])


def simulate(
    ropes: Rope | Sequence[Rope] | npt.ArrayLike,
    motion: Motion | Sequence[Motion],
    *,
    horizon_s: float | None = None,
    rate_hz: float | None = None,
    point_m: npt.ArrayLike | None = None,
    segment_m: npt.ArrayLike | None = None,
    height: bool = False,
    rest_window_s: float | None = None,
    step_s: float = 5e-4,
    precision: str = "f64",
    straight_rad: Sequence[float] | None = None,
    threads: int = THREADS,
) -> Simulation:
    """Simulates every rope, all under one motion or each under its own.

    ropes: one, several, or a table of shape (ropes, 9).
    horizon_s: simulated time; the longest motion's without it. The rope swings on when a throw has
        ended, and often hits only then: see `Plan.horizon_s`.
    rate_hz: keeps all nodes at this rate from t = 0 on.
    point_m, segment_m: measure the lead's closest approach, between steps too; a point may be
        one for all, (3,), or each rope's own, (ropes, 3).
    step_s: 0.5 ms is exact to 0.3 mm at the tip in ordinary motions.
    precision: "f32" is faster and less exact.
    straight_rad: rotation of a straight rope at the start; it hangs still without it.

    The interpreter's lock is released meanwhile; Ctrl-C counts when all ropes are simulated; results do not depend on `threads`.
    """
    motions = [motion] if isinstance(motion, Motion) else list(motion)
    if horizon_s is None:
        horizon_s = max((m.duration_s for m in motions), default=0.0)
    if precision not in ("f32", "f64"):
        raise _wag.InputError(f"`precision` is {precision!r}, but must be 'f32' or 'f64'")
    table, extras = tabled(ropes)
    points = None
    if point_m is not None:
        points = np.atleast_2d(numbers("point_m", point_m, (3,), (None, 3)))
    if segment_m is not None:
        segment_m = numbers("segment_m", segment_m, (2, 3)).tolist()
    if straight_rad is not None:
        straight_rad = numbers("straight_rad", straight_rad, (3,)).tolist()
    if number("horizon_s", horizon_s) <= 0.0:
        raise _wag.InputError(f"`horizon_s` is {horizon_s}, but must be above 0")
    wanted = {
        "horizon_s": float(horizon_s),
        "step_s": number("step_s", step_s),
        "single_precision": precision == "f32",
        "straight_rad": straight_rad,
        "rate_hz": None if rate_hz is None else number("rate_hz", rate_hz),
        "segment_m": segment_m,
        "height": bool(height),
        "rest_window_s": None if rest_window_s is None else number("rest_window_s", rest_window_s),
        "threads": whole("threads", threads, 1),
    }
    found = _wag.simulate(table, extras, motions, points, wanted)
    for name in ("point", "segment"):
        if name in found:
            found[name] = Approach(**found[name])
    return Simulation(**found)


class HangingRopes:
    """Ropes that hang from arms of their own and are moved on step by step.

    All begin at rest with the arms in `q_rad`, (7,). The world has nothing else in it, and the
    arms reach every place: limits are the caller's.
    """

    def __init__(
        self,
        ropes: Rope | Sequence[Rope] | npt.ArrayLike,
        q_rad: npt.ArrayLike,
        *,
        step_s: float = 5e-4,
        cell: str | os.PathLike[str] | None = None,
        threads: int = THREADS,
    ) -> None:
        table, extras = tabled(ropes)
        self._q_rad = numbers("q_rad", q_rad, (7,))
        self._ropes = _wag.HangingRopes(
            table,
            extras,
            self._q_rad,
            step_s=number("step_s", step_s),
            threads=whole("threads", threads, 1),
            cell=cell,
        )

    def replace(self, indices: Sequence[int], ropes: Sequence[Rope] | npt.ArrayLike) -> None:
        """Hangs other ropes in the place of some, with their arms back at the start."""
        table, extras = tabled(ropes)
        places = [whole("indices", i, 0) for i in indices]
        self._ropes.replace(places, table, extras, self._q_rad)

    def advance(self, qdd_rad_s2: npt.ArrayLike, period_s: float, samples: int = 1) -> Floats:
        """Moves all on by `period_s` under constant accelerations of their joints, (ropes, 7).

        Gives the leads' centres after each of `samples` equal parts, (ropes, samples, 3).
        """
        qdd = numbers("qdd_rad_s2", qdd_rad_s2, (None, 7))
        samples = whole("samples", samples, 1)
        return self._ropes.advance(qdd, number("period_s", period_s), samples)

    def joints(self) -> tuple[Floats, Floats]:
        """Positions and velocities of all arms' joints, (ropes, 7) each."""
        return self._ropes.joints()

    def nodes_m(self, index: int) -> Floats:
        """Nodes of one rope now, (links + 1, 3), clamp first."""
        return self._ropes.nodes(whole("index", index, 0))

    def finite(self) -> npt.NDArray[np.bool_]:
        """Which ropes' simulations have not blown up, (ropes,)."""
        return np.array(self._ropes.finite())
