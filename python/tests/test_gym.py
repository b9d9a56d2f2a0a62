"""The environments, by Gymnasium's own checker."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import wag
import wag.gym


@pytest.mark.parametrize("name", ["wag/Throw-v0", "wag/Swing-v0"])
def test_the_checker_passes(name):
    check_env(gymnasium.make(name).unwrapped, skip_render_check=True)


@pytest.mark.parametrize("name", ["wag/Throw-v0", "wag/Swing-v0"])
def test_a_seed_tells_everything(name):
    def episode():
        envs = gymnasium.make_vec(name, num_envs=8)
        observed, _ = envs.reset(seed=5)
        envs.action_space.seed(5)
        steps = [envs.step(envs.action_space.sample())[:2] for _ in range(3)]
        return [observed, *(x for step in steps for x in step)]

    for a, b in zip(episode(), episode(), strict=True):
        assert np.array_equal(a, b)


def test_a_planned_throw_is_as_good_in_the_environment():
    envs = wag.gym.ThrowVectorEnv(4, step_s=5e-4, precision="f64")
    envs.reset(seed=2)
    trials = envs._trials
    actions = np.zeros((4, 12))
    for i in range(4):
        rope = wag.Rope.from_array(trials.ropes[i])
        plan = wag.plan("strike", rope, trials.targets_m[i], seed=i)
        moved = list(wag.gym.MOVED)
        offset = (plan.waypoints_rad[1:] - wag.gym.START)[:, moved] / envs.reach_rad
        assert np.abs(offset).max() <= 1.0, "the action space holds what the planner plans"
        actions[i, :9] = offset.ravel()
        actions[i, 9:] = (np.diff(plan.times_s) - 0.375) / 0.225
    _, rewards, ended, _, infos = envs.step(actions)
    assert ended.all() and (infos["distance_m"] < 0.02).all(), infos["distance_m"]
    assert np.allclose(rewards, -infos["distance_m"])


def test_a_swing_ends_and_begins_anew():
    envs = gymnasium.make_vec("wag/Swing-v0", num_envs=3)
    envs.reset(seed=1)
    total = np.zeros(3)
    for step in range(1, 102):
        _, rewards, terminated, truncated, infos = envs.step(np.ones((3, 3), dtype=np.float32))
        assert not terminated.any() and truncated.all() == (step == 100)
        if step <= 100:
            total += rewards
        if step == 100:
            assert np.allclose(total, -infos["distance_m"])
    assert (rewards == 0.0).all()


def test_joints_stay_within_their_ranges_and_speeds():
    envs = wag.gym.SwingVectorEnv(2, qd_max_rad_s=3.0)
    envs.reset(seed=1)
    rng = np.random.default_rng(0)
    for _ in range(100):
        action = np.where(rng.random((2, 3)) < 0.9, [[1, 1, 1], [-1, -1, -1]], rng.uniform(-1, 1, (2, 3)))
        envs.step(action)
        q, qd = envs._hanging.joints()
        assert (np.abs(qd) <= 3.0 + 1e-9).all()
        moved = q[:, list(wag.gym.MOVED)]
        assert (moved >= wag.gym.LOWER - 1e-6).all() and (moved <= wag.gym.UPPER + 1e-6).all()
