"""Recorded runs as arrays and data frames."""

from __future__ import annotations

import dataclasses
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _wag
from ._wag import Motion
from .film import PathLike, Track
from .given import number
from .rope import Rope

if TYPE_CHECKING:
    import pandas as pd


@dataclasses.dataclass(frozen=True, eq=False)
class Run:
    """A run folder; what it does not hold is None."""

    folder: Path
    summary: dict[str, Any] | None
    """Every figure of it."""
    rope: Rope | None
    """As it was identified."""
    plan: dict[str, Any] | None
    keypoints: Track | None
    """Of the wiggle."""
    cycles: dict[str, np.ndarray]
    """One entry per control cycle, times in ns of CLOCK_MONOTONIC."""
    reports: dict[str, np.ndarray]
    """One entry per joint report, times in ns of CLOCK_MONOTONIC."""

    @property
    def epoch_ns(self) -> int:
        """When the film of the wiggle began, or else the first cycle (CLOCK_MONOTONIC)."""
        epoch_ns = (self.summary or {}).get("epoch_ns") or 0
        deadlines = self.cycles["deadline_ns"]
        return epoch_ns or (int(deadlines[0]) if len(deadlines) else 0)

    def motion(
        self, start_s: float = 0.0, end_s: float | None = None, *, cell: PathLike | None = None
    ) -> Motion:
        """The clamp's motion as the arm reported its joints, with t = 0 at `start_s`.

        start_s, end_s: in s since `epoch_ns`, where the film of a wiggle begins; to the end
            without `end_s`. A quarter of a second on either side is kept as well.
        """
        around_s = 0.25
        stamps_ns = self.reports["stamp_ns"].astype(np.int64)
        since_s = (stamps_ns - self.epoch_ns) * 1e-9 - number("start_s", start_s)
        kept = since_s >= -around_s
        if end_s is not None:
            kept &= since_s <= number("end_s", end_s) - start_s + around_s
        if not kept.any():
            words = f"`{self.folder}` holds no joint reports from {start_s} s on"
            raise _wag.InputError(f"{words}: times count from its `epoch_ns`")
        return Motion.joints(since_s[kept], self.reports["q_rad"][kept], cell=cell)

    def cycles_frame(self) -> pd.DataFrame:
        """Control cycles as a pandas data frame over time (s since `epoch_ns`)."""
        return self._frame(self.cycles, "deadline_ns")

    def reports_frame(self) -> pd.DataFrame:
        """Joint reports as a pandas data frame over time (s since `epoch_ns`)."""
        return self._frame(self.reports, "stamp_ns")

    def _frame(self, table: dict[str, np.ndarray], clock: str) -> pd.DataFrame:
        import pandas as pd

        columns: dict[str, Any] = {}
        for name, values in table.items():
            if values.ndim == 1:
                columns[name] = values
                continue
            what, _, unit = name.partition("_")
            for joint in range(values.shape[1]):
                columns[f"{what}{joint + 1}_{unit}"] = values[:, joint]
        since = table[clock].astype(np.int64) - self.epoch_ns
        return pd.DataFrame(columns, index=pd.Index(since * 1e-9, name="t_s"))


def load_run(folder: PathLike) -> Run:
    """Opens a run folder as `wag run`, `demo`, `throw`, `wiggle` and `record` make them."""
    cycles, reports = _wag.read_cycles(folder)
    path = Path(folder)
    rope, keypoints = path / "params.toml", path / "keypoints.json"
    return Run(
        folder=path,
        summary=_json(path / "summary.json"),
        rope=Rope.load(rope) if rope.is_file() else None,
        plan=_json(path / "plan.json"),
        keypoints=Track.load(keypoints) if keypoints.is_file() else None,
        cycles={name: np.asarray(values) for name, values in cycles.items()},
        reports={name: np.asarray(values) for name, values in reports.items()},
    )


def _json(path: Path) -> dict[str, Any] | None:
    if not path.is_file():
        return None
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        return found
    except ValueError as error:
        raise _wag.InputError(f"`{os.fspath(path)}` is not JSON: {error}") from error
