"""Gymnasium environments over the simulator: a throw in one step, or the rope step by step.

    import gymnasium
    import wag.gym  # registers them

    envs = gymnasium.make_vec("wag/Throw-v0", num_envs=1024)

``wag/Throw-v0`` is the planner's own task. An action holds three waypoints of the joints 2, 4
and 6 and the times between them; an episode is one throw, and its reward minus the lead's
distance (m) from the target where it comes nearest. ``wag/Swing-v0`` moves the same joints by
accelerations, 50 times a second. Ropes and targets are drawn anew for every episode, but where
`reset` is given `options` with ``ropes``, (envs, 9), or ``targets_m``, (envs, 3).
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from . import _wag
from ._wag import START_RAD, Motion, ranges_rad
from .given import Floats, numbers, positive, whole
from .rope import PARAMETERS
from .simulation import THREADS, HangingRopes, simulate

MOVED = (1, 3, 5)
"""Joints that actions move, counted from 0."""
START = np.array(START_RAD)
"""Pose from which everything begins (rad)."""
LOWER, UPPER = np.array(ranges_rad()).T[:, MOVED]
"""Ranges of these joints (rad)."""
LOW, HIGH = (np.array([getattr(p, end) for p in PARAMETERS]) for end in ("min", "max"))
TARGET_LOW = np.array([0.45, -0.65, -0.2])
TARGET_HIGH = np.array([1.1, 0.65, 0.7])


class _Trials:
    """Ropes and targets of as many episodes as are asked for."""

    def __init__(self, rng: np.random.Generator, count: int) -> None:
        seeds = rng.integers(2**63, size=count).tolist()
        self.ropes = np.array([_wag.random_rope(seed) for seed in seeds])
        self.ropes[:, 0] = np.round(self.ropes[:, 0])
        self.targets_m = np.array([_wag.random_target(seed) for seed in seeds])

    def given(self, options: dict[str, Any] | None) -> _Trials:
        """The same with ropes and targets that a caller of `reset` chose."""
        options, count = dict(options or {}), len(self.ropes)
        self.ropes = numbers("ropes", options.pop("ropes", self.ropes), (count, len(PARAMETERS)))
        self.targets_m = numbers("targets_m", options.pop("targets_m", self.targets_m), (count, 3))
        if options:
            raise _wag.InputError(f"options are `ropes` and `targets_m`, not {', '.join(options)}")
        return self

    def context(self) -> Floats:
        """Parameters and targets, each from -1 to 1, (trials, 12)."""
        ropes = 2.0 * (self.ropes - LOW) / (HIGH - LOW) - 1.0
        targets = 2.0 * (self.targets_m - TARGET_LOW) / (TARGET_HIGH - TARGET_LOW) - 1.0
        context: Floats = np.concatenate([ropes, targets], axis=1)
        return context.clip(-1.0, 1.0)


def _actions(envs: VectorEnv, actions: Any) -> Floats:
    """One action for each environment, once these were reset."""
    if not hasattr(envs, "_trials"):
        raise gymnasium.error.ResetNeeded("call reset() before step()")
    return numbers("actions", actions, envs.action_space.shape or ())


def _describe(
    envs: VectorEnv, mode: AutoresetMode, actions: int, observed: tuple[int, float]
) -> None:
    """Numbers of an action, from -1 to 1, and of an observation, with their bound."""
    size, bound = observed
    envs.metadata = {"autoreset_mode": mode, "render_modes": []}
    envs.single_action_space = spaces.Box(-1.0, 1.0, (actions,), np.float32)
    envs.single_observation_space = spaces.Box(-bound, bound, (size,), np.float32)
    envs.action_space = batch_space(envs.single_action_space, envs.num_envs)
    envs.observation_space = batch_space(envs.single_observation_space, envs.num_envs)


class ThrowVectorEnv(VectorEnv):
    """Whole throws at targets, all simulated in one call.

    Action, 12 numbers from -1 to 1: three waypoints of the joints 2, 4 and 6, as offsets of up
    to `reach_rad` from the start pose, joint 1 turned to the target's bearing; then the three
    times between them, 0.15 to 0.6 s. A throw faster than the arm's limits is slowed down as a
    whole; what comes later than `HORIZON_S` does not count. One that leaves a joint's range is not
    thrown: its miss is `NOT_THROWN_M`, more than any throw's.

    `info`: ``distance_m``, ``time_s`` and ``slowed``, how much a throw was slowed.
    """

    WAYPOINTS = 3
    HORIZON_S = 2.5
    NOT_THROWN_M = 3.0

    def __init__(
        self,
        num_envs: int = 1,
        *,
        reach_rad: float = 1.6,
        step_s: float = 1e-3,
        precision: str = "f32",
        threads: int = THREADS,
    ) -> None:
        self.num_envs = whole("num_envs", num_envs, 1)
        self.reach_rad, self.step_s = positive("reach_rad", reach_rad), positive("step_s", step_s)
        self.precision, self.threads = precision, whole("threads", threads, 1)
        size = self.WAYPOINTS * (len(MOVED) + 1)
        _describe(self, AutoresetMode.SAME_STEP, size, (len(PARAMETERS) + 3, 1.0))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        self._trials = _Trials(self.np_random, self.num_envs).given(options)
        return self._observed(), {}

    def _observed(self) -> np.ndarray:
        return self._trials.context().astype(np.float32)

    def throws(self, actions: np.ndarray) -> tuple[Floats, Floats]:
        """Times (throws, 4) in s and joints (throws, 4, 7) in rad that actions ask for."""
        actions = np.clip(_actions(self, actions), -1.0, 1.0)
        split = self.WAYPOINTS * len(MOVED)
        offsets = self.reach_rad * actions[:, :split].reshape(-1, self.WAYPOINTS, len(MOVED))
        q_rad = np.tile(START, (self.num_envs, self.WAYPOINTS + 1, 1))
        q_rad[:, 1:, MOVED] += offsets
        targets = self._trials.targets_m
        q_rad[:, :, 0] = np.arctan2(targets[:, 1], targets[:, 0])[:, None]
        times_s = np.zeros((self.num_envs, self.WAYPOINTS + 1))
        times_s[:, 1:] = np.cumsum(0.375 + 0.225 * actions[:, split:], axis=1)
        return times_s, q_rad

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, Floats, np.ndarray, np.ndarray, dict[str, Any]]:
        motions, slowed, is_within = Motion.throws(
            *self.throws(actions), threads=self.threads
        )
        found = simulate(
            self._trials.ropes,
            motions,
            horizon_s=self.HORIZON_S,
            point_m=self._trials.targets_m,
            step_s=self.step_s,
            precision=self.precision,
            threads=self.threads,
        )
        near = found.point
        assert near is not None  # it was asked for
        thrown = is_within & ~found.diverged
        distance_m = np.where(thrown, near.distance_m, self.NOT_THROWN_M)
        final, self._trials = self._trials, _Trials(self.np_random, self.num_envs)
        infos = {
            "distance_m": distance_m,
            "time_s": np.where(thrown, near.time_s, self.HORIZON_S),
            "slowed": slowed,
            "final_obs": final.context().astype(np.float32),
        }
        ended = np.ones(self.num_envs, dtype=bool)
        infos |= {f"_{name}": ended.copy() for name in infos}
        return self._observed(), -distance_m, ended, np.zeros_like(ended), infos


class SwingVectorEnv(VectorEnv):
    """Ropes moved on 50 times a second.

    Action, 3 numbers from -1 to 1: accelerations of the joints 2, 4 and 6, in parts of
    `qdd_max_rad_s2`; what would leave `qd_max_rad_s` or the joints' ranges brakes instead.
    Observation: positions and velocities of these joints, the lead's place relative to the
    target and its velocity, in the plane that joint 1 has turned to the target, the rope's parameters
    and the target, in the world. The reward of all steps
    together is minus the least distance (m) of the episode, which lasts 2 s.
    """

    PERIOD_S, STEPS, SAMPLES = 0.02, 100, 5

    def __init__(
        self,
        num_envs: int = 1,
        *,
        qd_max_rad_s: float = 3.0,
        qdd_max_rad_s2: float = 15.0,
        step_s: float = 1e-3,
        threads: int = THREADS,
    ) -> None:
        self.num_envs = whole("num_envs", num_envs, 1)
        self.threads, self.step_s = whole("threads", threads, 1), positive("step_s", step_s)
        self.qd_max_rad_s = positive("qd_max_rad_s", qd_max_rad_s)
        self.qdd_max_rad_s2 = positive("qdd_max_rad_s2", qdd_max_rad_s2)
        size = 2 * len(MOVED) + 6 + len(PARAMETERS) + 3
        _describe(self, AutoresetMode.NEXT_STEP, len(MOVED), (size, np.inf))

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        count = self.num_envs
        self._trials = _Trials(self.np_random, count).given(options)
        self._hanging = HangingRopes(
            self._trials.ropes, START, step_s=self.step_s, threads=self.threads
        )
        self._tips_m = np.zeros((count, self.SAMPLES, 3))
        self._least_m, self._steps = np.zeros(count), np.zeros(count, dtype=int)
        self._ended = np.zeros(count, dtype=bool)
        self._begin(np.arange(count))
        return self._observed(), {}

    def _begin(self, places: np.ndarray) -> None:
        """What is known of episodes that begin."""
        tips_m = np.array([self._hanging.nodes_m(i)[-1] for i in places])
        self._tips_m[places] = tips_m[:, None]
        self._least_m[places] = np.linalg.norm(tips_m - self._targets_m()[places], axis=1)
        self._steps[places], self._ended[places] = 0, False

    def _targets_m(self) -> Floats:
        """Targets in the arm's plane: a rope hangs alike in every plane through its axis."""
        x, y, z = self._trials.targets_m.T
        return np.stack([np.hypot(x, y), np.zeros_like(x), z], axis=1)

    def _observed(self) -> np.ndarray:
        q, qd = self._hanging.joints()
        tip_m = self._tips_m[:, -1]
        velocity_m_s = (tip_m - self._tips_m[:, -2]) * self.SAMPLES / self.PERIOD_S
        seen = [
            (q - START)[:, MOVED],
            qd[:, MOVED],
            tip_m - self._targets_m(),
            velocity_m_s,
            self._trials.context(),
        ]
        observed: np.ndarray = np.concatenate(seen, axis=1)
        finite: np.ndarray = np.nan_to_num(observed)
        return finite.astype(np.float32)

    def _fastest(self, left_rad: Floats, qd_rad_s: Floats) -> Floats:
        """Speed towards a limit at the period's end from which a joint still brakes before it."""
        most, period_s = self.qdd_max_rad_s2, self.PERIOD_S
        # The last period of braking ends at rest, after less than the most acceleration.
        left_rad = left_rad - most * period_s**2 / 8.0 - 0.5 * qd_rad_s * period_s
        under = np.clip(0.25 * period_s**2 + 2.0 * left_rad / most, 0.0, None)
        return most * (np.sqrt(under) - 0.5 * period_s)

    def _allowed(self, actions: np.ndarray) -> Floats:
        """Accelerations of all joints that keep speeds and ranges, (envs, 7) in rad/s²."""
        asked = np.clip(_actions(self, actions), -1.0, 1.0)
        q, qd = (joints[:, MOVED] for joints in self._hanging.joints())
        most = self.qdd_max_rad_s2
        wanted = most * asked
        up = np.minimum(self.qd_max_rad_s, self._fastest(UPPER - q, qd))
        down = np.minimum(self.qd_max_rad_s, self._fastest(q - LOWER, -qd))
        bounded = np.clip(wanted, (-down - qd) / self.PERIOD_S, (up - qd) / self.PERIOD_S)
        qdd = np.zeros((self.num_envs, len(START)))
        qdd[:, MOVED] = np.clip(bounded, -most, most)
        return qdd

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, Floats, np.ndarray, np.ndarray, dict[str, Any]]:
        allowed = self._allowed(actions)
        anew = np.flatnonzero(self._ended)
        before = self._least_m.copy()
        self._tips_m = self._hanging.advance(allowed, self.PERIOD_S, self.SAMPLES)
        far_m = np.linalg.norm(self._tips_m - self._targets_m()[:, None], axis=2).min(axis=1)
        self._least_m = np.fmin(self._least_m, far_m)
        self._steps += 1
        if anew.size:
            drawn = _Trials(self.np_random, anew.size)
            self._trials.ropes[anew] = drawn.ropes
            self._trials.targets_m[anew] = drawn.targets_m
            self._hanging.replace(anew.tolist(), drawn.ropes)
            self._begin(anew)
        first = self._steps == 1
        rewards = np.where(first, -self._least_m, before - self._least_m)
        rewards[anew] = 0.0
        terminated = ~self._hanging.finite()
        truncated = (self._steps >= self.STEPS) & ~terminated
        self._ended = terminated | truncated
        every = np.ones(self.num_envs, dtype=bool)
        infos = {"distance_m": self._least_m.copy(), "_distance_m": every}
        return self._observed(), rewards, terminated, truncated, infos


class _One(gymnasium.Env):
    """The first environment of a vector of one."""

    metadata = {"render_modes": []}

    def __init__(self, of: type[ThrowVectorEnv] | type[SwingVectorEnv], **options: Any) -> None:
        self._all = of(1, **options)
        self.action_space = self._all.single_action_space
        self.observation_space = self._all.single_observation_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed)
        # Further episodes go on in the random numbers of the seed.
        if seed is not None or not hasattr(self._all, "_trials"):
            start = int(self.np_random.integers(2**31))
            observed, _ = self._all.reset(seed=start, options=options)
        else:
            observed, _ = self._all.reset(options=options)
        return observed[0], {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        observed, rewards, terminated, truncated, infos = self._all.step(np.asarray(action)[None])
        seen = infos.pop("final_obs", observed)
        told = {name: values for name, values in infos.items() if not name.startswith("_")}
        info = {name: float(values[0]) for name, values in told.items()}
        return seen[0], float(rewards[0]), bool(terminated[0]), bool(truncated[0]), info


class ThrowEnv(_One):
    """One environment of :class:`ThrowVectorEnv`."""

    def __init__(self, **options: Any) -> None:
        super().__init__(ThrowVectorEnv, **options)


class SwingEnv(_One):
    """One environment of :class:`SwingVectorEnv`."""

    def __init__(self, **options: Any) -> None:
        super().__init__(SwingVectorEnv, **options)


_KNOWN: tuple[tuple[str, Any, Any], ...] = (
    ("wag/Throw-v0", ThrowEnv, ThrowVectorEnv),
    ("wag/Swing-v0", SwingEnv, SwingVectorEnv),
)
for _name, _of, _vector in _KNOWN:
    gymnasium.register(_name, entry_point=_of, vector_entry_point=_vector)
