"""Identify a rope from one filmed wiggle, simulate it, plan a throw that strikes a target.

    import wag

    rope = wag.Rope.random(seed=1)
    plan = wag.plan("strike", rope, target_m=(0.95, 0.0, 0.2))
    flight = wag.simulate([rope], plan.motion(), horizon_s=plan.horizon_s, point_m=plan.target_m)
    print(flight.point.distance_m)

Lengths are in metres, angles in radians, times in seconds, in the world frame of the arm (x
forward, y left, z up, REP-103); the last word of a name is its unit. What is wrong with an
argument raises :class:`InputError`, a ``ValueError``; work that fails raises
:class:`FailedError`, a ``RuntimeError``; both in the words of the command line.
"""

from ._wag import VERSION as __version__
from ._wag import FailedError, InputError, Motion
from .film import Estimate, Track, UnconfirmedError, identify, track
from .rig import Rig
from .rope import PARAMETERS, Parameter, Rope, random_target
from .run import Run, load_run
from .simulation import Approach, HangingRopes, Simulation, simulate
from .throw import Plan, plan

__all__ = [
    "Approach",
    "Estimate",
    "FailedError",
    "HangingRopes",
    "InputError",
    "Motion",
    "PARAMETERS",
    "Parameter",
    "Plan",
    "Rig",
    "Rope",
    "Run",
    "Simulation",
    "Track",
    "UnconfirmedError",
    "__version__",
    "identify",
    "load_run",
    "plan",
    "random_target",
    "simulate",
    "track",
]
