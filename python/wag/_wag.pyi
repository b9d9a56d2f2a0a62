"""The native half of the package; what it gives is made pleasant by its neighbours."""

import os
from collections.abc import Sequence
from typing import Any, final

import numpy as np
import numpy.typing as npt

_Path = str | os.PathLike[str]
_Floats = npt.NDArray[np.float64]
_Extras = Sequence[str | None]

VERSION: str
START_RAD: list[float]

class InputError(ValueError):
    """What was given cannot be worked with: the message names it, its limits and what to do."""

class FailedError(RuntimeError):
    """The work itself failed: the message says at what, and what to do."""

@final
class Motion:
    """Motion of the rope's clamp in time: t = 0 is its begin, or a film's first frame."""

    @staticmethod
    def joints(times_s: npt.ArrayLike, q_rad: npt.ArrayLike, *, cell: _Path | None = None) -> Motion:
        """Joints as an arm reported them, (times,) and (times, 7): a smooth curve near them."""
    @staticmethod
    def joints_file(
        path: _Path, *, film_late_s: float = 0.0, cell: _Path | None = None
    ) -> Motion:
        """The same from a file ``joints.csv``."""
    @staticmethod
    def poses(times_s: npt.ArrayLike, position_m: npt.ArrayLike, quaternion_wxyz: npt.ArrayLike) -> Motion:
        """Poses of the clamp, nearly without noise: a curve through all of them."""
    @staticmethod
    def poses_file(path: _Path, *, film_late_s: float = 0.0) -> Motion:
        """The same from a file ``pose.csv``."""
    @staticmethod
    def waypoints(times_s: npt.ArrayLike, q_rad: npt.ArrayLike, *, cell: _Path | None = None) -> Motion:
        """An arm that follows a clamped cubic spline through these joints exactly: a throw."""
    @staticmethod
    def throws(
        times_s: npt.ArrayLike,
        q_rad: npt.ArrayLike,
        *,
        limits: _Path | None = None,
        cell: _Path | None = None,
        threads: int | None = None,
    ) -> tuple[list[Motion], _Floats, npt.NDArray[np.bool_]]:
        """Throws through (throws, waypoints, 7) at (throws, waypoints), each slowed down as a
        whole until the arm's limits hold; how much each was slowed, and whether its joints stay
        within their ranges."""
    @staticmethod
    def wiggle() -> Motion:
        """The wiggle that is filmed."""
    @property
    def duration_s(self) -> float: ...
    def at(self, times_s: npt.ArrayLike) -> tuple[_Floats, _Floats]:
        """Positions (times, 3) in m and attitudes (times, 3, 3), clamp to world."""

@final
class HangingRopes:
    def __new__(
        cls,
        table: _Floats,
        extras: _Extras,
        q_rad: _Floats,
        *,
        step_s: float,
        threads: int,
        cell: _Path | None = None,
    ) -> HangingRopes: ...
    def replace(
        self, indices: Sequence[int], table: _Floats, extras: _Extras, q_rad: _Floats
    ) -> None: ...
    def advance(self, qdd_rad_s2: _Floats, period_s: float, samples: int) -> _Floats: ...
    def joints(self) -> tuple[_Floats, _Floats]: ...
    def nodes(self, index: int) -> _Floats: ...
    def finite(self) -> list[bool]: ...

@final
class Rig:
    command_port: int
    report_ports: list[int]
    def __new__(cls, setup: dict[str, Any]) -> Rig: ...
    def is_running(self) -> bool: ...
    def stop(self) -> None: ...

def parameters() -> list[tuple[str, str, str, float, float]]: ...
def ranges_rad() -> list[tuple[float, float]]: ...
def random_rope(seed: int) -> list[float]: ...
def random_target(seed: int) -> list[float]: ...
def read_rope(path: _Path) -> str: ...
def write_rope(
    path: _Path, rope: str, estimate: str | None = None, unconfirmed: Sequence[str] = ...
) -> None: ...
def write_text(path: _Path, text: str) -> None: ...
def read_cycles(run: _Path) -> tuple[dict[str, Any], dict[str, Any]]: ...
def simulate(
    table: _Floats,
    extras: _Extras,
    motions: Sequence[Motion],
    points_m: _Floats | None,
    wanted: dict[str, Any],
) -> dict[str, Any]: ...
def track(
    video: _Path, camera: _Path, motion: Motion, keypoints: int, rate_hz: float | None = None
) -> str: ...
def identify(
    keypoints: str,
    camera: _Path,
    motion: Motion,
    radii_m: Sequence[float | None],
    how: dict[str, Any],
) -> str: ...
def identify_run(
    run: _Path, how: dict[str, Any], accepted: bool, cell: _Path | None = None
) -> tuple[str | None, list[str]]: ...
def fitted_pixels(
    estimate: str, camera: _Path, motion: Motion, times_s: _Floats, keypoints: int
) -> _Floats: ...
def drawn_ropes(rope: str, posterior: str, count: int, seed: int) -> str: ...
def spline(
    times_s: npt.ArrayLike, q_rad: npt.ArrayLike, at_s: npt.ArrayLike
) -> tuple[_Floats, _Floats, _Floats]: ...
def plan(
    task: str,
    rope: str,
    posterior: str | None,
    target_m: Sequence[float],
    given: dict[str, Any],
) -> str: ...
