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


def test_a_throw_does_not_depend_on_its_neighbours():
    envs, one = wag.gym.ThrowVectorEnv(6), wag.gym.ThrowVectorEnv(1)
    envs.reset(seed=4)
    one.reset(seed=1)
    trials = envs._trials
    envs.action_space.seed(4)
    actions = envs.action_space.sample()
    *_, infos = envs.step(actions)
    for i in range(6):
        one._trials.ropes, one._trials.targets_m = trials.ropes[i : i + 1], trials.targets_m[i : i + 1]
        *_, alone = one.step(actions[i : i + 1])
        assert alone["distance_m"][0] == pytest.approx(infos["distance_m"][i], abs=1e-6)


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


@pytest.mark.parametrize("envs", [wag.gym.ThrowVectorEnv, wag.gym.SwingVectorEnv])
def test_what_cannot_be_done_is_told(envs):
    size = envs(2).single_action_space.shape[0]
    with pytest.raises(gymnasium.error.ResetNeeded):
        envs(2).step(np.zeros((2, size)))
    made = envs(2)
    with pytest.raises(wag.InputError, match="target"):
        made.reset(options={"target": [1.0, 0.0, 0.0]})
    made.reset(seed=1, options={"targets_m": [[0.9, 0.0, 0.1]] * 2})
    assert (made._trials.targets_m == [0.9, 0.0, 0.1]).all()
    for actions in (np.zeros((1, size)), np.zeros(size), None):
        with pytest.raises(wag.InputError, match="actions"):
            made.step(actions)
    for wrong in ({"num_envs": 0}, {"step_s": -1.0}, {"threads": 0}):
        with pytest.raises(wag.InputError, match=next(iter(wrong))):
            envs(**{"num_envs": 2, **wrong})


def test_a_throw_out_of_a_joint_s_range_misses_by_more_than_any():
    envs = wag.gym.ThrowVectorEnv(2, reach_rad=6.0)
    envs.reset(seed=1)
    out_of_range, within = np.ones((1, 12)), np.zeros((1, 12))
    _, rewards, *_ = envs.step(np.concatenate([out_of_range, within]))
    assert rewards[0] == -envs.NOT_THROWN_M < rewards[1]


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
