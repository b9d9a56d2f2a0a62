"""Ropes, motions and reference tip tracks of the truth set."""
import dataclasses
import json
import math
import pathlib

import numpy as np

FOLDER = pathlib.Path(__file__).resolve().parents[3] / "shared/reference/rope-truth"
CHANNELS = ("x", "y", "z", "yaw", "pitch", "roll")


class CubicSpline:
    """Uniform cubic B-spline channel that starts and stops at rest; constant after its end."""

    def __init__(self, knot_spacing_s, control_points):
        self.knot_spacing_s = float(knot_spacing_s)
        self.control_points = np.asarray(control_points, float)

    @property
    def segments(self):
        return len(self.control_points) - 3

    def value(self, t_s):
        """Value at the times `t_s`, any shape."""
        u = np.clip(np.asarray(t_s) / self.knot_spacing_s, 0.0, self.segments)
        j = np.minimum(u.astype(int), self.segments - 1)
        u = u - j
        p = [self.control_points[j + i] for i in range(4)]
        basis = ((1 - u) ** 3, 3 * u**3 - 6 * u**2 + 4, -3 * u**3 + 3 * u**2 + 3 * u + 1, u**3)
        return sum(b * q for b, q in zip(basis, p)) / 6

    def knot_accelerations(self):
        """Times and second derivatives at the knots; linear in between."""
        p = self.control_points
        times_s = self.knot_spacing_s * np.arange(self.segments + 1)
        return times_s, (p[:-2] - 2 * p[1:-1] + p[2:]) / self.knot_spacing_s**2


@dataclasses.dataclass(frozen=True)
class Case:
    """One rope on one motion."""

    id: str
    rope: dict
    channels: dict
    arm_m: tuple
    duration_s: float
    frame_rate_hz: float
    tip_m: np.ndarray  # (frames, 3)

    @property
    def frame_count(self):
        return len(self.tip_m)

    def error_mm(self, tip_m):
        """Largest distance of a tip track from the reference, not finite counting as infinite."""
        worst = 1e3 * np.linalg.norm(tip_m - self.tip_m, axis=1).max()
        return float(worst) if math.isfinite(worst) else math.inf

    def channel_accelerations(self, name):
        """Knot times and accelerations of one channel (zero for one that stands still)."""
        channel = self.channels[name]
        if channel is None:
            return np.array([0.0, self.duration_s]), np.zeros(2)
        return channel.knot_accelerations()


def derived(rope):
    """Link length, mass and inertia and lead inertia of a rope (rope model, section "Parameters")."""
    s, m = rope["L"] / rope["N"], rope["mu"] * rope["L"] / rope["N"]
    radius_m = max(rope["link_extra_scale"] * s / 2, rope["r"])
    return s, m, 0.4 * m * radius_m**2, 0.4 * rope["m_L"] * rope["r_L"] ** 2


def load(case_id):
    """Reads one case; its motion must consist of splines and constants at zero."""
    path = FOLDER / "manifest.json"
    if not path.is_file():
        raise SystemExit(f"{path} not found: the comparison needs the truth set to measure errors against")
    manifest = json.loads(path.read_text())
    entry = next((c for c in manifest["cases"] if c["id"] == case_id), None)
    if entry is None:
        raise SystemExit(f"{case_id}: no such case in {path}")
    motion = manifest["motions"][entry["motion"]]
    channels = {}
    for name in CHANNELS:
        described = motion["channels"][name]
        if described["type"] == "bspline3":
            channels[name] = CubicSpline(described["h"], described["ctrl"])
            still_at_zero = channels[name].control_points[0] == 0.0
        else:
            channels[name] = None
            still_at_zero = described["type"] == "const" and described["value"] == 0.0
        if not still_at_zero:
            raise SystemExit(f"{case_id}: channel {name} must start at 0 and be a spline or constant, is {described}")
    return Case(
        id=case_id,
        rope=manifest["ropes"][entry["rope"]],
        channels=channels,
        arm_m=tuple(motion["arm"]),
        duration_s=float(motion["duration"]),
        frame_rate_hz=float(entry["rate"]),
        tip_m=np.load(FOLDER / entry["nodes"])[:, -1].astype(float),
    )
