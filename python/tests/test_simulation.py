"""The simulator from Python."""

import numpy as np
import pytest
import wag


@pytest.fixture
def ropes():
    return [wag.Rope.random(seed) for seed in range(40)]


def test_a_hanging_rope_hangs_straight_down():
    rope = wag.Rope.random(3)
    still = wag.Motion.waypoints(np.array([0.0, 0.5]), np.tile([0, 0.8, 0, 2.4, 0, 1.6, 0], (2, 1)))
    found = wag.simulate(rope, still, rate_hz=10.0)
    (nodes,) = found.nodes_m
    assert nodes.shape == (6, rope.links + 1, 3)
    position_m, attitude = still.at(np.array([0.0]))
    assert np.allclose(nodes[:, 0], position_m, atol=1e-12)
    assert np.allclose(nodes[:, -1], position_m[0] - [0, 0, rope.length_m], atol=1e-6)
    assert np.allclose(attitude[0].T @ attitude[0], np.eye(3), atol=1e-12)
    assert not found.diverged.any() and not found.rerun.any()


def test_a_table_is_as_good_as_ropes_and_threads_change_nothing(ropes):
    wiggle = wag.Motion.wiggle()
    table = np.array([rope.array() for rope in ropes])
    one = wag.simulate(ropes, wiggle, rate_hz=60.0, threads=1)
    two = wag.simulate(table, wiggle, rate_hz=60.0, threads=2)
    assert all(np.array_equal(a, b) for a, b in zip(one.nodes_m, two.nodes_m, strict=True))
    assert one.tips_m().shape == (40, len(one.nodes_m[0]), 3)


def test_single_precision_is_close_and_stays_single(ropes):
    wiggle = wag.Motion.wiggle()
    f64, f32 = (wag.simulate(ropes, wiggle, rate_hz=30.0, precision=p) for p in ("f64", "f32"))
    assert f32.nodes_m[0].dtype == np.float32
    assert np.abs(f64.tips_m() - f32.tips_m()).max() < 1e-3


def test_nodes_are_not_copied(ropes):
    nodes = wag.simulate(ropes[0], wag.Motion.wiggle(), rate_hz=60.0).nodes_m[0]
    assert not nodes.flags.owndata and nodes.flags.c_contiguous and nodes.flags.writeable


def test_each_rope_may_have_a_motion_and_a_point_of_its_own(ropes):
    start = np.array([0, 0.8, 0, 2.4, 0, 1.6, 0.0])
    times = np.tile([0.0, 0.4, 0.8], (40, 1))
    q = np.tile(start, (40, 3, 1))
    q[:, 1, 5] += np.linspace(-0.4, 0.4, 40)
    motions, slowed, within = wag.Motion.throws(times, q)
    assert within.all() and (slowed >= 1.0).all() and len(motions) == 40
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (40, 3)) + [0.7, 0.0, 0.0]
    together = wag.simulate(ropes, motions, point_m=points, horizon_s=1.0)
    for i in (0, 17, 39):
        alone = wag.simulate(ropes[i], motions[i], point_m=points[i], horizon_s=1.0)
        assert together.point.distance_m[i] == pytest.approx(alone.point.distance_m[0], abs=1e-9)
        tip = together.point.tip_m[i]
        assert np.linalg.norm(tip - points[i]) == pytest.approx(together.point.distance_m[i])


def test_a_throw_that_is_too_fast_is_slowed_within_the_limits():
    start = np.array([0, 0.8, 0, 2.4, 0, 1.6, 0.0])
    q = np.tile(start, (1, 2, 1))
    q[0, 1, 1] = -0.5
    (motion,), (slowed,), (within,) = wag.Motion.throws(np.array([[0.0, 0.1]]), q)
    assert slowed > 3.0 and within
    again = wag.Motion.throws(np.array([[0.0, 0.1 * slowed * 1.000001]]), q)
    assert again[1][0] == 1.0 and motion.duration_s == pytest.approx(0.1 * slowed)
    q[0, 1, 1] = -7.0
    assert not wag.Motion.throws(np.array([[0.0, 5.0]]), q)[2][0]


def test_step_by_step_is_as_at_once(ropes):
    start, qdd, period_s = np.array([0, 0.8, 0, 2.4, 0, 1.6, 0.0]), np.zeros((2, 7)), 0.1
    qdd[:, 5] = 4.0
    hanging = wag.HangingRopes(ropes[:2], start, step_s=2e-4)
    for sign in (1.0, -1.0):
        tips = hanging.advance(sign * qdd, period_s, samples=4)
    assert tips.shape == (2, 4, 3) and hanging.finite().all()
    q, qd = hanging.joints()
    assert q[0, 5] == pytest.approx(1.6 + 4.0 * period_s**2) and abs(qd).max() < 1e-12
    # The same as poses: positions of the clamp over time.
    t = np.linspace(0.0, 0.2, 401)
    ramp = np.where(t < 0.1, 2.0 * t**2, 0.04 - 2.0 * (0.2 - t) ** 2)
    q = np.tile(start, (401, 1))
    q[:, 5] += ramp
    frames = [wag.Motion.waypoints(np.array([0.0, 1.0]), np.tile(row, (2, 1))) for row in q]
    poses = [frame.at(np.array([0.0])) for frame in frames]
    position = np.concatenate([p for p, _ in poses])
    w = np.array([_quaternion(r[0]) for _, r in poses])
    whole = wag.simulate(ropes[:2], wag.Motion.poses(t, position, w), rate_hz=5.0, step_s=2e-4)
    assert np.abs(whole.tips_m()[:, 1] - tips[:, -1]).max() < 2e-4


def _quaternion(r):
    """Of a rotation matrix whose angle is below half a turn or about y, scalar first."""
    w = np.sqrt(max(0.0, 1 + r[0, 0] + r[1, 1] + r[2, 2])) / 2
    x = np.copysign(np.sqrt(max(0.0, 1 + r[0, 0] - r[1, 1] - r[2, 2])) / 2, r[2, 1] - r[1, 2])
    y = np.copysign(np.sqrt(max(0.0, 1 - r[0, 0] + r[1, 1] - r[2, 2])) / 2, r[0, 2] - r[2, 0])
    z = np.copysign(np.sqrt(max(0.0, 1 - r[0, 0] - r[1, 1] + r[2, 2])) / 2, r[1, 0] - r[0, 1])
    return np.array([w, x, y, z])


def test_extras_count(ropes):
    drag = {"drag_per_m": 1.0}
    from dataclasses import replace

    curled = replace(ropes[0], extras={"rest_curvature_per_m": [0.5, 0.0, 0.0]})
    still = wag.Motion.waypoints(np.array([0.0, 0.5]), np.tile([0, 0.8, 0, 2.4, 0, 1.6, 0], (2, 1)))
    straight, bent = (wag.simulate(r, still, rate_hz=2.0).tips_m() for r in (ropes[0], curled))
    assert np.abs(straight - bent).max() > 1e-3
    with pytest.raises(wag.InputError, match="drag_per_m"):
        wag.simulate(replace(ropes[0], extras=drag), still)


def test_what_was_asked_for_is_there_even_of_no_rope(ropes):
    none = wag.simulate([], wag.Motion.wiggle(), point_m=[0.9, 0, 0], height=True, rate_hz=10)
    assert none.point.distance_m.shape == (0,) and none.highest_m.shape == (0,)
    assert none.tips_m().shape == (0, 0, 3) and none.point.tip_m.shape == (0, 3)
    listed = wag.Motion.waypoints([0, 1], [[0, 1, 0, 2, 0, 1, 0], [0, 1, 0, 2, 0, 2, 0]])
    assert wag.simulate(ropes[0], listed).segment is None


def test_a_rope_that_diverges_is_not_a_number(ropes):
    q = np.zeros((3, 7))
    q[1] = 200.0
    whip = wag.Motion.waypoints([0, 0.004, 0.008], q)
    found = wag.simulate(ropes[0], whip, horizon_s=0.5, point_m=[1, 0, 0], rate_hz=60, height=True)
    assert found.diverged.all() and np.isnan(found.nodes_m[0]).all()
    assert np.isnan(found.point.distance_m).all() and np.isnan(found.highest_m).all()


def test_wrong_input_is_refused_in_words(ropes):
    wiggle = wag.Motion.wiggle()
    for given, words in [
        ({"step_s": 0.0}, "step_s"),
        ({"rate_hz": -1.0}, "rate_hz"),
        ({"precision": "f16"}, "precision"),
        ({"point_m": [[0.0, 0.0]]}, "shape"),
        ({"horizon_s": -1.0, "rate_hz": 60.0}, "horizon_s"),
        ({"rate_hz": 1e9}, "rate_hz"),
        ({"threads": 0}, "threads"),
        ({"segment_m": [0.0, 1.0]}, "segment_m"),
        ({"straight_rad": [0.0]}, "straight_rad"),
        ({"step_s": "fast"}, "step_s"),
        ({"point_m": np.zeros((3, 3))}, "one point or 2"),
        ({"point_m": [np.nan] * 3}, "point_m"),
    ]:
        with pytest.raises(wag.InputError, match=words):
            wag.simulate(ropes[:2], wiggle, **given)
    with pytest.raises(wag.InputError, match="one motion or 2"):
        wag.simulate(ropes[:2], [wiggle] * 3)
    with pytest.raises(wag.InputError, match="length_m"):
        wag.simulate(wag.Rope.from_array([20, -1, 0.01, 0.1, 0.005, 0.05, 0.05, 0.02, 1]), wiggle)
    with pytest.raises(wag.InputError, match=r"\(n, 9\)"):
        wag.simulate(np.zeros((2, 8)), wiggle)
    for wrong in (lambda: wag.Rope.random(-1), lambda: wag.Rope.random(1.5)):
        with pytest.raises(wag.InputError, match="seed"):
            wrong()
    for wrong in ([np.nan] * 9, [1.0] * 8, "rope"):
        with pytest.raises(wag.InputError, match="parameters"):
            wag.Rope.from_array(wrong)
    hanging = wag.HangingRopes(ropes[:2], [0, 0.8, 0, 2.4, 0, 1.6, 0])
    for given, words in [
        ((np.zeros((2, 6)), 0.1), "qdd_rad_s2"),
        ((np.zeros((3, 7)), 0.1), "shape"),
        ((np.full((2, 7), np.nan), 0.1), "finite"),
        ((np.zeros((2, 7)), 1e9), "steps"),
        ((np.zeros((2, 7)), 0.1, 10**12), "samples"),
    ]:
        with pytest.raises(wag.InputError, match=words):
            hanging.advance(*given)
    with pytest.raises(wag.InputError, match="length_m"):
        hanging.replace([0, 1], [ropes[3], wag.Rope(20, -1, 0.01, 0.1, 0.005, 0.05, 0.05, 0.02, 1)])
    assert np.allclose(hanging.nodes_m(0)[-1] - hanging.nodes_m(0)[0], [0, 0, -ropes[0].length_m])
    assert issubclass(wag.InputError, ValueError) and issubclass(wag.FailedError, RuntimeError)
