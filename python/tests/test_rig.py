"""The simulated rig, films and runs from Python."""

import os
import shutil
import socket
import subprocess
from pathlib import Path

import numpy as np
import pytest
import wag

WAG = os.environ.get("WAG_PROGRAM") or shutil.which("wag")


def test_the_arm_listens_while_the_block_lasts():
    with wag.Rig(seed=3) as rig:
        port = rig.command_port
        socket.create_connection(("127.0.0.1", port), timeout=5.0).close()
        assert rig.arguments[:2] == ["--arm", "127.0.0.1"]
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.1", port), timeout=1.0)
    with pytest.raises(wag.InputError, match="does not run"):
        rig.command_port


def test_a_port_in_use_is_told():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        with pytest.raises(wag.FailedError):
            wag.Rig(command_port=taken.getsockname()[1]).start()


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A whole run of the program against a rig of this process."""
    assert WAG, "the program `wag` is missing: build it, and name it in WAG_PROGRAM"
    folder = tmp_path_factory.mktemp("run") / "strike"
    with wag.Rig(seed=11, camera=f"python-{os.getpid()}") as rig:
        command = [WAG, "run", "strike", *rig.arguments, "--yes", "--keep-films"]
        done = subprocess.run([*command, "--out", str(folder)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder


def test_a_run_is_arrays_and_frames(run):
    found = wag.load_run(run)
    assert found.summary["ok"] and found.rope is not None
    assert found.plan["trajectory_sha256"] and found.keypoints.points_px.ndim == 3
    cycles, reports = found.cycles, found.reports
    assert cycles["q_commanded_rad"].shape == (len(cycles["cycle"]), 7)
    assert (np.diff(reports["stamp_ns"].astype(np.int64)) > 0).all()
    pytest.importorskip("pandas")
    frame = found.reports_frame()
    assert {"q1_rad", "q7_rad", "qd3_rad_s"} <= set(frame.columns) and frame.index.name == "t_s"


def test_a_run_exported_for_numpy_is_the_run(run, tmp_path):
    out = tmp_path / "run.npz"
    subprocess.run([WAG, "export", "npz", str(run), "--out", str(out)], check=True)
    found, kept = np.load(out), wag.load_run(run)
    assert found["epoch_ns"] == kept.epoch_ns
    for name, table in [("cycles", kept.cycles), ("reports", kept.reports)]:
        assert {f"{name}/{column}" for column in table} == {
            key for key in found if key.startswith(f"{name}/")
        }
        for column, values in table.items():
            assert np.array_equal(found[f"{name}/{column}"], values), (name, column)
    track = kept.keypoints
    for column in ("t_s", "points_px", "confidence", "lost"):
        assert np.array_equal(found[f"keypoints/{column}"], getattr(track, column)), column
    for parameter in wag.PARAMETERS:
        assert found[f"rope/{parameter.key}"] == getattr(kept.rope, parameter.key), parameter.key


def test_the_rope_of_a_run_is_identified_again(run):
    kept = wag.load_run(run)
    found = wag.identify(run, seed=int(kept.summary["seed"]) if "seed" in kept.summary else 0)
    assert abs(found.rope.length_m - kept.rope.length_m) < 2e-3
    low, high = found.interval_90[1]
    assert low < found.rope.length_m < high and found.covariance.shape == (9, 9)
    plan = wag.plan("strike", found, [0.95, 0.0, 0.2])
    assert plan.forecast is not None
    ropes = found.draw(400, seed=1)
    masses, lengths = ([getattr(r, k) for r in ropes] for k in ("lead_mass_kg", "length_m"))
    assert np.mean(lengths) == pytest.approx(found.mean[1], abs=1e-3)
    assert np.std(masses) == pytest.approx(np.sqrt(found.covariance[6, 6]), rel=0.2)
    assert ropes == found.draw(400, seed=1) and ropes != found.draw(400, seed=2)
    with pytest.raises(wag.InputError, match="count"):
        found.draw(0)
    motion = kept.motion()
    with pytest.raises(wag.InputError, match="t_s"):
        found.keypoints_px(run / "camera.toml", motion, [np.nan])
    with pytest.raises(wag.InputError, match="film lasts"):
        found.keypoints_px(run / "camera.toml", motion, [500.0])
    with pytest.raises(wag.InputError, match="joint reports"):
        kept.motion(1e6)


def test_a_film_is_tracked_as_the_run_did(run):
    kept = wag.load_run(run)
    film = next(Path(run).glob("wiggle_*.yuyv"))
    track = wag.track(film, run / "camera.toml", kept.motion(0.0, kept.keypoints.t_s[-1]))
    apart = np.linalg.norm(track.points_px - kept.keypoints.points_px, axis=2)
    assert np.median(apart) < 0.1 and not track.unconfirmed
    short = kept.motion(0.0, 0.5)
    with pytest.raises(wag.InputError, match="film lasts"):
        wag.track(film, run / "camera.toml", short)


def test_no_run_and_no_keypoints_are_told(tmp_path):
    with pytest.raises(wag.InputError, match="does not exist"):
        wag.load_run(tmp_path / "nothing")
    (tmp_path / "keypoints.json").write_text("{}")
    with pytest.raises(wag.InputError, match="not keypoints"):
        wag.Track.load(tmp_path / "keypoints.json")
