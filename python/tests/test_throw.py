"""Identification, plans and files from Python."""

import json
import signal
import threading
import time

import numpy as np
import pytest
import wag


def test_a_plan_hits_in_the_simulation_and_can_be_thrown(tmp_path):
    rope = wag.Rope.random(1)
    plan = wag.plan("strike", rope, [0.95, 0.0, 0.2], seed=1)
    assert plan.success and plan.predicted_error_m < 0.005
    found = wag.simulate(rope, plan.motion(), horizon_s=plan.horizon_s, point_m=plan.target_m)
    assert found.point.distance_m[0] == pytest.approx(plan.predicted_error_m, abs=1e-4)
    plan.save(tmp_path / "plan.json")
    kept = json.loads((tmp_path / "plan.json").read_text())
    assert kept["trajectory_sha256"] == plan.details["trajectory_sha256"]


def test_joints_of_a_plan_are_its_spline():
    plan = wag.plan("strike", wag.Rope.random(1), [0.95, 0.0, 0.2], seed=1)
    q_rad, qd_rad_s, qdd_rad_s2 = plan.joints(plan.times_s)
    assert np.allclose(q_rad, plan.waypoints_rad, atol=1e-12) and np.allclose(qd_rad_s[[0, -1]], 0.0)
    t_s, h_s = np.linspace(0.1, plan.duration_s - 0.1, 50), 1e-4
    before, after = plan.joints(t_s - h_s), plan.joints(t_s + h_s)
    _, speeds, accelerations = plan.joints(t_s)
    assert np.abs((after[0] - before[0]) / (2 * h_s) - speeds).max() < 1e-4
    assert np.abs((after[1] - before[1]) / (2 * h_s) - accelerations).max() < 0.01
    assert np.allclose(plan.joints([plan.duration_s + 1.0])[0], plan.waypoints_rad[-1])
    with pytest.raises(wag.InputError, match="at_s"):
        plan.joints([[0.5]])


def test_a_target_out_of_reach_is_refused():
    with pytest.raises(wag.InputError, match="out of reach"):
        wag.plan("strike", wag.Rope.random(1), [3.0, 0.0, 0.2])
    with pytest.raises(wag.InputError, match="strike, lob or drape"):
        wag.plan("hit", wag.Rope.random(1), [0.95, 0.0, 0.2])
    for target in ([1.0, 2.0], [np.nan] * 3, "there"):
        with pytest.raises(wag.InputError, match="target"):
            wag.plan("strike", wag.Rope.random(1), target)
    with pytest.raises(wag.InputError, match="seed"):
        wag.plan("strike", wag.Rope.random(1), [0.95, 0.0, 0.2], seed=-1)
    with pytest.raises(wag.InputError, match="robust"):
        wag.plan("strike", wag.Rope.random(1), [0.95, 0.0, 0.2], robust=8)


def test_a_rope_file_comes_back(tmp_path):
    rope = wag.Rope.random(5)
    rope.save(tmp_path / "rope.toml")
    assert wag.Rope.load(tmp_path / "rope.toml") == rope
    with pytest.raises(wag.InputError, match="nothing.toml"):
        wag.Rope.load(tmp_path / "nothing.toml")


@pytest.fixture
def ctrl_c():
    """Where the tests run in the background of a shell, Ctrl-C is ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_ends_a_plan(ctrl_c, tmp_path):
    endless = tmp_path / "planner.toml"
    endless.write_text("[search]\ngenerations = 1000000\npopulation = 2000\nlibrary_candidates = 0\n")
    pressed = threading.Timer(0.3, lambda: signal.raise_signal(signal.SIGINT))
    pressed.start()
    with pytest.raises(KeyboardInterrupt):
        wag.plan("strike", wag.Rope.random(1), [0.95, 0.0, 0.2], config=endless)


def test_the_interpreter_is_free_while_ropes_are_simulated():
    ticks = 0
    done = threading.Event()

    def tick():
        nonlocal ticks
        while not done.is_set():
            ticks += 1
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    table = np.array([wag.Rope.random(seed).array() for seed in range(512)])
    wag.simulate(table, wag.Motion.wiggle(), threads=1)
    done.set()
    thread.join()
    assert ticks > 20
