"""Plans of throws."""

from __future__ import annotations

import dataclasses
import json
import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _wag
from ._wag import FailedError, Motion
from .film import Estimate, PathLike, UnconfirmedError
from .given import Floats, numbers, whole
from .rope import Rope
from .simulation import THREADS


AFTER_S = 0.5
"""So long after a throw its rope is looked at."""


@dataclasses.dataclass(frozen=True, eq=False)
class Plan:
    """A checked throw: a clamped cubic spline through joint waypoints, from rest to rest."""

    task: str
    target_m: Floats
    rope: Rope
    times_s: Floats
    """(waypoints,), the first is 0."""
    waypoints_rad: Floats
    """(waypoints, 7)"""
    predicted_error_m: float
    """The task's own error, of the simulation with what the task puts there, a board or a wall."""
    predicted_time_s: float
    success: bool
    """Whether the simulated throw does what the task asks."""
    forecast: dict[str, Any] | None
    """Error to expect of a rope that is only known as well as it was identified."""
    warnings: list[str]
    shortcoming: str | None
    """Why it should not be thrown, if so."""
    details: dict[str, Any]
    """Everything, as ``plan.json`` holds it."""
    cell: PathLike | None = None
    """The cell file that it was planned with; built in without one."""

    @property
    def duration_s(self) -> float:
        return float(self.times_s[-1])

    @property
    def horizon_s(self) -> float:
        """Until when to simulate it: the rope swings on, and often hits, when the arm stands."""
        return self.duration_s + AFTER_S

    def motion(self, cell: PathLike | None = None) -> Motion:
        """The clamp's motion under an arm that follows the plan exactly, in the plan's own cell."""
        return Motion.waypoints(self.times_s, self.waypoints_rad, cell=cell or self.cell)

    def joints(self, at_s: npt.ArrayLike) -> tuple[Floats, Floats, Floats]:
        """Positions, velocities and accelerations of the joints, (times, 7) each, in rad and s."""
        return _wag.spline(self.times_s, self.waypoints_rad, numbers("at_s", at_s, (None,)))

    def save(self, path: PathLike, *, allow_miss: bool = False) -> None:
        """Writes the ``plan.json`` that `wag throw` takes; a plan with a shortcoming only if told so."""
        if self.shortcoming is not None and not allow_miss:
            words = f"{self.shortcoming}; `{os.fspath(path)}` is not written"
            raise FailedError(f"{words}, allow_miss=True would write it")
        _wag.write_text(path, json.dumps(self.details, indent=2))


def plan(
    task: str,
    rope: Rope | Estimate | PathLike,
    target_m: npt.ArrayLike,
    *,
    seed: int = 0,
    robust: int = 0,
    limits: PathLike | None = None,
    cell: PathLike | None = None,
    config: PathLike | None = None,
    arm_response: PathLike | None = None,
    accept_unconfirmed: bool = False,
    threads: int = THREADS,
) -> Plan:
    """Plans a throw.

    task: "strike", "lob" or "drape".
    rope: known, identified, or a rope file.
    robust: plans for this many ropes that it might be instead; needs an identified rope.
    limits, cell, config, arm_response: files as of `wag plan`; built in without them.

    Raises InputError for a target out of reach, before anything is simulated.
    """
    posterior, unconfirmed = None, []
    if isinstance(rope, Estimate):
        posterior, unconfirmed, rope = rope.details["posterior"], rope.unconfirmed, rope.rope
    elif isinstance(rope, np.ndarray):
        rope = Rope.from_array(rope)
    elif not isinstance(rope, (str, os.PathLike, Rope)):
        raise _wag.InputError(f"`rope` is a {type(rope).__name__}, but must be a Rope, an Estimate or a file")
    elif not isinstance(rope, Rope):
        read = json.loads(_wag.read_rope(os.fspath(rope)))
        posterior, unconfirmed, rope = read["posterior"], read["unconfirmed"], Rope(**read["rope"])
    if unconfirmed and not accept_unconfirmed:
        words = f"the track that the rope is from is unconfirmed: {'; '.join(unconfirmed)}"
        raise UnconfirmedError(f"{words}; pass accept_unconfirmed=True to go on")
    if robust and posterior is None:
        raise _wag.InputError("`robust` needs an identified rope: a known one is no other")
    given = {
        "seed": whole("seed", seed, 0),
        "robust": whole("robust", robust, 0),
        "limits": limits,
        "cell": cell,
        "config": config,
        "arm_response": arm_response,
        "threads": whole("threads", threads, 1),
    }
    target = numbers("target_m", target_m, (3,)).tolist()
    kept = None if posterior is None else json.dumps(posterior)
    found = json.loads(_wag.plan(task, rope.to_json(), kept, target, given))
    made = found["plan"] | {"unconfirmed": list(unconfirmed)}
    return Plan(
        task=made["task"],
        target_m=np.array(made["target_m"]),
        rope=rope,
        times_s=np.array(made["trajectory"]["times_s"]),
        waypoints_rad=np.array(made["trajectory"]["waypoints_rad"]),
        predicted_error_m=made["predicted_error_m"],
        predicted_time_s=made["predicted_time_s"],
        success=made["verdict"]["success"],
        forecast=made["forecast"],
        warnings=found["warnings"],
        shortcoming=found["shortcoming"],
        details=made,
        cell=cell,
    )
