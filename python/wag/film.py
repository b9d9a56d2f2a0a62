"""From a film to keypoints, from keypoints to a rope."""

from __future__ import annotations

import dataclasses
import json
import os
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _wag
from ._wag import FailedError, Motion
from .given import Floats, number, numbers, whole
from .rope import Rope
from .simulation import THREADS

PathLike = str | os.PathLike[str]


class UnconfirmedError(FailedError):
    """A track that should not be relied on; ``accept_unconfirmed=True`` goes on all the same."""


@dataclasses.dataclass(frozen=True, eq=False)
class Track:
    """Keypoints of a film, at equal distances along the rope, clamp first, lead's centre last."""

    t_s: Floats
    """(frames,), 0 at the first one."""
    points_px: Floats
    """Pixels of the left image as filmed, (frames, keypoints, 2)."""
    confidence: Floats
    """(frames, keypoints), 0 to 1."""
    lost: npt.NDArray[np.bool_]
    """(frames,)"""
    unconfirmed: list[str] = dataclasses.field(default_factory=list)
    """Why it should not be relied on; empty where it may be."""
    radii_m: tuple[float | None, float | None] = (None, None)
    """Of rope and lead, as seen."""
    clamp: dict[str, float] | None = None
    """Whether the film bears out time and place of the clamp."""

    @classmethod
    def load(cls, path: PathLike) -> Track:
        """Reads ``keypoints.json``."""
        try:
            with open(path, encoding="utf-8") as file:
                return cls._of(json.load(file))
        except OSError as error:
            words = f"cannot read `{os.fspath(path)}`: {error.strerror}"
            raise _wag.InputError(words) from error
        except (ValueError, KeyError, TypeError) as error:
            lacks = f"lacks {error}" if isinstance(error, KeyError) else str(error)
            words = f"`{os.fspath(path)}` is not keypoints (JSON, as `wag track` writes them): {lacks}"
            raise _wag.InputError(words) from error

    def save(self, path: PathLike) -> None:
        """Writes ``keypoints.json``."""
        _wag.write_text(path, self.to_json())

    @classmethod
    def _of(cls, kept: dict[str, Any], **others: Any) -> Track:
        frames, count = kept["frames"], kept["keypoints"]
        points_px = numbers("points", [f["points"] for f in frames], (None, count, 2))
        return cls(
            t_s=numbers("t_s", [f["t_s"] for f in frames], (None,)),
            points_px=points_px,
            confidence=numbers("confidence", [f["confidence"] for f in frames], (None, count)),
            lost=np.array([f["lost"] for f in frames], dtype=bool),
            unconfirmed=kept.get("unconfirmed", []),
            **others,
        )

    def to_json(self) -> str:
        rows = zip(self.t_s, self.points_px, self.confidence, self.lost, strict=True)
        frames = [
            {"t_s": float(t), "points": p.tolist(), "confidence": c.tolist(), "lost": bool(lost)}
            for t, p, c, lost in rows
        ]
        kept = {"keypoints": self.points_px.shape[1], "frames": frames}
        return json.dumps(kept | {"unconfirmed": list(self.unconfirmed)})


@dataclasses.dataclass(frozen=True, eq=False)
class Estimate:
    """An identified rope, and how well it is known. Arrays are in the order of ``PARAMETERS``."""

    rope: Rope
    mean: Floats
    """(9,)"""
    covariance: Floats
    """(9, 9)"""
    interval_90: Floats
    """Ends of the intervals that hold the truth with a probability of 90 %, (9, 2)."""
    residual_px: float
    """Root mean square distance of keypoints and simulated rope."""
    method: str
    warnings: list[str]
    """What speaks against relying on it, each with what to do."""
    out_of_distribution: dict[str, Any]
    unconfirmed: list[str]
    """Why the track should not be relied on."""
    details: dict[str, Any]
    """Everything that was found, as `wag identify --json` prints it."""

    @classmethod
    def _of(cls, text: str, unconfirmed: list[str]) -> Estimate:
        found = json.loads(text)
        posterior = found["posterior"]
        return cls(
            rope=Rope(**found["params"]),
            mean=np.array(posterior["mean"]),
            covariance=np.array(posterior["covariance"]),
            interval_90=np.array(posterior["interval_90"]),
            residual_px=found["residual_px"],
            method=found["method"],
            warnings=found["warnings"],
            out_of_distribution=found["out_of_distribution"],
            unconfirmed=unconfirmed,
            details=found,
        )

    def keypoints_px(
        self, camera: PathLike, motion: Motion, t_s: npt.ArrayLike, *, keypoints: int = 24
    ) -> Floats:
        """Where the simulated rope's keypoints are seen in frames at `t_s`, (frames, keypoints, 2).

        With the clocks' offset and the camera's place as the fit found them: what is left between
        them and `Track.points_px` is the residual. NaN behind the camera.
        """
        frames_s = numbers("t_s", t_s, (None,))
        keypoints = whole("keypoints", keypoints, 2, 32)
        return _wag.fitted_pixels(json.dumps(self.details), camera, motion, frames_s, keypoints)

    def draw(self, count: int, *, seed: int = 0) -> list[Rope]:
        """Ropes that it might be instead, drawn from the posterior as the planner draws them."""
        posterior = json.dumps(self.details["posterior"])
        count, seed = whole("count", count, 1, 1_000_000), whole("seed", seed, 0)
        drawn = _wag.drawn_ropes(self.rope.to_json(), posterior, count, seed)
        return [Rope(**rope) for rope in json.loads(drawn)]

    def save(self, path: PathLike) -> None:
        """Writes the rope file that `wag plan --rope` takes, uncertainty included."""
        _wag.write_rope(path, self.rope.to_json(), json.dumps(self.details), self.unconfirmed)


def track(
    video: PathLike,
    camera: PathLike,
    motion: Motion,
    *,
    keypoints: int = 24,
    rate_hz: float | None = None,
) -> Track:
    """Finds the rope in a film of both images.

    camera: ``camera.toml``, with the calibration beside it.
    motion: the clamp's; t = 0 is the film's first frame.
    rate_hz: of a recording that does not tell the times of its frames.
    """
    keypoints = whole("keypoints", keypoints, 2, 32)
    rate_hz = None if rate_hz is None else number("rate_hz", rate_hz)
    found = json.loads(_wag.track(video, camera, motion, keypoints, rate_hz))
    radii_m = (found["rope_radius_m"], found["lead_radius_m"])
    return Track._of(found["track"], radii_m=radii_m, clamp=found["clamp"])


def identify(
    keypoints: Track | PathLike,
    camera: PathLike | None = None,
    motion: Motion | None = None,
    *,
    method: str = "hybrid",
    seed: int = 0,
    length_m: float | None = None,
    lead_mass_kg: float | None = None,
    accept_unconfirmed: bool = False,
    config: PathLike | None = None,
    cell: PathLike | None = None,
    threads: int = THREADS,
) -> Estimate:
    """Identifies the rope of a filmed wiggle.

    keypoints: a track, its file, or the folder of a run, which tells camera and motion itself.
    method: "hybrid", "hybrid_search", "cmaes" (the paper's) or "network".
    length_m, lead_mass_kg: as measured with tape and scale, if they were.
    cell: of a run, in the place of its own.
    """
    how = {
        "method": method,
        "seed": whole("seed", seed, 0),
        "length_m": None if length_m is None else number("length_m", length_m),
        "lead_mass_kg": None if lead_mass_kg is None else number("lead_mass_kg", lead_mass_kg),
        "threads": whole("threads", threads, 1),
        "config": config,
    }
    if not isinstance(keypoints, Track) and not os.path.exists(keypoints):
        words = f"`{os.fspath(keypoints)}` does not exist"
        raise _wag.InputError(f"{words}: name a run's folder, or keypoints as `wag track` writes them")
    if not isinstance(keypoints, Track) and os.path.isdir(keypoints):
        if camera is not None or motion is not None:
            words = f"`{os.fspath(keypoints)}` is a run, which tells camera and motion itself"
            raise _wag.InputError(f"{words}: leave these out")
        found, unconfirmed = _wag.identify_run(keypoints, how, accept_unconfirmed, cell)
        if found is None:
            _confirm(unconfirmed, False)
        assert found is not None  # or it was not confirmed, which has been raised
        return Estimate._of(found, unconfirmed)
    if cell is not None:
        raise _wag.InputError("`cell` is for a run: give it to the motion instead")
    if camera is None or motion is None:
        raise _wag.InputError("name camera and motion: only a run's folder tells them itself")
    given = keypoints if isinstance(keypoints, Track) else Track.load(keypoints)
    _confirm(given.unconfirmed, accept_unconfirmed)
    found = _wag.identify(given.to_json(), camera, motion, list(given.radii_m), how)
    return Estimate._of(found, list(given.unconfirmed))


def _confirm(unconfirmed: list[str], accepted: bool) -> None:
    if unconfirmed and not accepted:
        words = f"the track of the rope is unconfirmed: {'; '.join(unconfirmed)}"
        raise UnconfirmedError(f"{words}; look at its overlay, or pass accept_unconfirmed=True")
