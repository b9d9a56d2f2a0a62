"""The task of `wag/Throw-v0` in MuJoCo's Python: throws per second at equal accuracy.

    pip install mujoco-core dist/wag-*.whl gymnasium     # the wheel by `maturin build`
    python benches/peers/throws.py

The same ropes, throws and targets in both. What is compared is the environment's reward, the
lead's least distance from its target. Truth is the simulator at a twelfth of its step, in double
precision; that MuJoCo tends to the same is shown by its error, which falls with its step.
The environment is measured at several steps; beside each MuJoCo gets the longest step at which it
errs no more, to a third, and as many times the speed of one thread as the environment has. That
flatters it where processors share a core or its caches: `--threads 1` compares one with one.
`mujoco.rollout` with inputs made before and not timed, and what its distance costs is not timed
either. The environment is timed as a whole.
"""

import argparse
import dataclasses
import json
import time

import gymnasium
import mujoco
import mujoco.rollout
import numpy as np
import wag
import wag.gym
from mujoco_rope import model_xml
from truth import CHANNELS

HORIZON_S = wag.gym.ThrowVectorEnv.HORIZON_S
SAMPLE_HZ = 1600
"""Rate of MuJoCo's tip; between samples it moves on straight lines, which errs by 0.2 um."""
STEPS_S = (1e-3, 2e-3, 3e-3)
"""Steps of the environment; its own is the first."""
MOVED_S = 0.3
STEPS_PER_CALL = 5000
STEPS_PER_SAMPLE = (1, 2, 3, 4, 6, 8, 11, 15, 20, 27, 36, 48, 64, 85, 113, 150)
KEYS = {
    "links": "N",
    "length_m": "L",
    "joint_damping_nms_per_rad": "c",
    "joint_stiffness_nm_per_rad": "k",
    "radius_m": "r",
    "mass_per_length_kg_per_m": "mu",
    "lead_mass_kg": "m_L",
    "lead_radius_m": "r_L",
    "link_extra_scale": "link_extra_scale",
}


@dataclasses.dataclass(frozen=True)
class Throw:
    """One rope on one throw in the plane y = 0, which every bearing is turned into."""

    rope: dict
    motion: wag.Motion
    target_m: np.ndarray

    arm_m = (0.0, 0.0, 0.0)
    """The rope hangs from the middle of the driven base."""

    @property
    def begin_m(self):
        """Where the base is at first; MuJoCo's origin."""
        return self.motion.at([0.0])[0][0]

    def controls(self, step_s, steps):
        """Accelerations of the driven base that put it exactly on its path, (steps, 6)."""
        position_m, attitude = self.motion.at(step_s * np.arange(steps + 1))
        path = np.zeros((steps + 1, len(CHANNELS)))
        path[:, :3] = position_m - position_m[0]
        path[:, CHANNELS.index("pitch")] = np.unwrap(
            np.arctan2(attitude[:, 0, 2], attitude[:, 0, 0])
        )
        return np.diff(np.concatenate([path[:1], path]), 2, axis=0) / step_s**2

    def distance_m(self, tip_m):
        """Least distance of a track from the target, (samples, 3)."""
        a, along = tip_m[:-1] + self.begin_m - self.target_m, np.diff(tip_m, axis=0)
        length2 = np.maximum((along**2).sum(axis=1), 1e-30)
        part = np.clip(-(a * along).sum(axis=1) / length2, 0.0, 1.0)
        return float(np.linalg.norm(a + part[:, None] * along, axis=1).min())


def throws(env, seed):
    """Throws of the environment that stay within the joints' ranges."""
    env.reset(seed=seed)
    trials = env._trials  # noqa: SLF001
    actions = np.random.default_rng(seed).uniform(-1, 1, env.action_space.shape)
    times_s, q_rad = env.throws(actions)
    q_rad[:, :, 0] = 0.0
    motions, _, within = wag.Motion.throws(times_s, q_rad)
    x, y, z = trials.targets_m.T
    targets_m = np.stack([np.hypot(x, y), np.zeros_like(x), z], axis=1)
    names = [parameter.key for parameter in wag.PARAMETERS]
    made = []
    for index in np.flatnonzero(within):
        values = dict(zip(names, trials.ropes[index].tolist(), strict=True))
        rope = {short: values[name] for name, short in KEYS.items()}
        made.append((index, Throw(rope | {"N": int(rope["N"])}, motions[index], targets_m[index])))
    return trials, made


def by_wag(trials, made, step_s, precision):
    """Least distances of the same throws in the simulator (m), and their times (s)."""
    indices = [index for index, _ in made]
    found = wag.simulate(
        trials.ropes[indices],
        [throw.motion for _, throw in made],
        horizon_s=HORIZON_S,
        point_m=np.array([throw.target_m for _, throw in made]),
        step_s=step_s,
        precision=precision,
    )
    return found.point.distance_m, found.point.time_s


def by_mujoco(made, per_sample):
    """Least distances in MuJoCo (m), and seconds of the stepping alone, on one thread."""
    step_s = 1.0 / (SAMPLE_HZ * per_sample)
    samples = round(HORIZON_S * SAMPLE_HZ)
    models = []
    for _, throw in made:
        xml = model_xml(throw, "Euler", step_s)
        models.append(mujoco.MjModel.from_xml_string(xml))
    controls = [throw.controls(step_s, samples * per_sample) for _, throw in made]
    full = mujoco.mjtState.mjSTATE_FULLPHYSICS
    tips_m = np.zeros((len(made), samples + 1, 3))
    spent_s = 0.0
    # Models of one size go together, as the library wants them.
    for links in sorted({throw.rope["N"] for _, throw in made}):
        group = [i for i, (_, throw) in enumerate(made) if throw.rope["N"] == links]
        size = mujoco.mj_stateSize(models[group[0]], full)
        data = mujoco.MjData(models[group[0]])
        states = np.zeros((len(group), size))
        for row, i in enumerate(group):
            mujoco.mj_getState(models[i], mujoco.MjData(models[i]), states[row], full)
            tips_m[i, 0] = [0.0, 0.0, -made[i][1].rope["L"]]
        inputs = np.stack([controls[i] for i in group])
        own = [models[i] for i in group]
        together = max(1, STEPS_PER_CALL // per_sample)
        for first in range(0, samples, together):
            last = min(first + together, samples)
            part = inputs[:, first * per_sample : last * per_sample]
            begin = time.perf_counter()
            out, _ = mujoco.rollout.rollout(own, data, states, part)
            spent_s += time.perf_counter() - begin
            states = out[:, -1].copy()
            for row, i in enumerate(group):
                for sample in range(first, last):
                    state = out[row, (sample - first + 1) * per_sample - 1]
                    mujoco.mj_setState(own[row], data, state, full)
                    mujoco.mj_kinematics(own[row], data)
                    tips_m[i, sample + 1] = data.xpos[-1]
    found = [throw.distance_m(tips_m[i]) for i, (_, throw) in enumerate(made)]
    return np.array(found), spent_s


def percentile_mm(found, truth):
    wrong = 1e3 * np.abs(found - truth)
    return float(np.percentile(np.where(np.isfinite(wrong), wrong, np.inf), 90, method="higher"))


def environment_rate(seed, num_envs, step_s, turns, threads):
    """Throws per second of the environment, the median of some turns."""
    how = {"step_s": step_s, "threads": threads}
    envs = gymnasium.make_vec("wag/Throw-v0", num_envs=num_envs, **how)
    envs.reset(seed=seed)
    envs.action_space.seed(seed)
    rates = []
    for _ in range(turns):
        actions = envs.action_space.sample()
        begin = time.perf_counter()
        envs.step(actions)
        rates.append(num_envs / (time.perf_counter() - begin))
    return float(np.median(rates))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--throws", type=int, default=24, help="compared with MuJoCo")
    parser.add_argument("--envs", type=int, default=1024)
    parser.add_argument("--turns", type=int, default=10)
    parser.add_argument("--threads", type=int, default=wag.simulation.THREADS)
    given = parser.parse_args()
    env = wag.gym.ThrowVectorEnv(10 * given.throws)
    trials, made = throws(env, given.seed)
    # A lead that is nearest before it moves says nothing of a simulation.
    _, time_s = by_wag(trials, made, env.step_s, "f64")
    made = [one for one, t_s in zip(made, time_s, strict=True) if t_s > MOVED_S][: given.throws]
    truth, _ = by_wag(trials, made, env.step_s / 12, "f64")
    ours = []
    for step_s in STEPS_S:
        found, _ = by_wag(trials, made, step_s, env.precision)
        rate = environment_rate(given.seed, given.envs, step_s, given.turns, given.threads)
        error_mm = percentile_mm(found, truth)
        ours.append({"step_us": 1e6 * step_s, "error_p90_mm": error_mm, "throws_per_s": rate})
    best_mm = min(row["error_p90_mm"] for row in ours)
    peers = []
    for per_sample in STEPS_PER_SAMPLE:
        found, spent_s = by_mujoco(made, per_sample)
        step_us, error_mm = 1e6 / (SAMPLE_HZ * per_sample), percentile_mm(found, truth)
        rate = given.threads * len(made) / spent_s
        peers.append({"step_us": step_us, "error_p90_mm": error_mm, "throws_per_s": rate})
        print(peers[-1], flush=True)
        if error_mm <= best_mm:
            break
    for row in ours:
        as_exact = [p for p in peers if p["error_p90_mm"] <= row["error_p90_mm"]]
        row["faster_by"] = row["throws_per_s"] / as_exact[0]["throws_per_s"] if as_exact else None
    report = {
        "mujoco": mujoco.__version__,
        "seed": given.seed,
        "throws": len(made),
        "threads": given.threads,
        "environment": ours,
        "mujoco_steps": peers,
    }
    print(json.dumps(report, indent=2))


if __name__ == "__main__":
    main()
