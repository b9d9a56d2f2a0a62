"""The simulated arm and camera."""

from __future__ import annotations

import os
import weakref
from collections.abc import Sequence
from types import TracebackType

from . import _wag
from .given import whole
from .rope import Rope

PathLike = str | os.PathLike[str]


class Rig:
    """A simulated xArm 7 with a rope, and a camera that films it, while a ``with`` block lasts.

        with wag.Rig(seed=3, camera="lab") as rig:
            subprocess.run(["wag", "run", "strike", *rig.arguments, "--yes"])

    The arm listens on TCP of this machine alone. It runs in threads of this process, in real
    time: whoever keeps the interpreter busy does not hold it up.
    """

    def __init__(
        self,
        *,
        seed: int = 0,
        rope: Rope | None = None,
        camera: str | None = None,
        task: str = "strike",
        command_port: int = 0,
        report_ports: Sequence[int] = (0, 0, 0, 0),
        cell: PathLike | None = None,
    ) -> None:
        """
        rope: drawn from the seed without one.
        camera: shared-memory domain that it films into; without one it does not film.
        task: where the camera stands: "strike", "lob" or "drape".
        command_port, report_ports: any free ones where they are 0.
        """
        if task not in ("strike", "lob", "drape"):
            raise _wag.InputError(f"`task` is {task!r}, but must be 'strike', 'lob' or 'drape'")
        self._camera = camera
        self._setup = {
            "seed": whole("seed", seed, 0),
            "rope": None if rope is None else rope.to_json(),
            "camera": camera,
            "task": task,
            "command_port": whole("command_port", command_port, 0, 65535),
            "report_ports": [whole("report_ports", port, 0, 65535) for port in report_ports],
            "cell": cell,
        }
        self._rig: _wag.Rig | None = None

    def start(self) -> Rig:
        """Starts it; the arm listens when this returns."""
        if self._rig is None:
            self._rig = _wag.Rig(self._setup)
            # Nothing of it stays in shared memory, however the interpreter ends.
            weakref.finalize(self, self._rig.stop)
        return self

    def stop(self) -> None:
        """Ends it, and raises what it failed at."""
        rig, self._rig = self._rig, None
        if rig is not None:
            rig.stop()

    def __enter__(self) -> Rig:
        return self.start()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def _running(self) -> _wag.Rig:
        if self._rig is None:
            raise _wag.InputError("the rig does not run: use it in a `with` block, or start() it")
        return self._rig

    @property
    def command_port(self) -> int:
        return self._running().command_port

    @property
    def report_ports(self) -> list[int]:
        return list(self._running().report_ports)

    @property
    def arguments(self) -> list[str]:
        """What the commands of `wag` need to work with it."""
        joints, _, status, _ = self.report_ports
        named = {
            "--arm": "127.0.0.1",
            "--command-port": self.command_port,
            "--report-port": joints,
            "--status-port": status,
        }
        if self._camera is not None:
            named["--camera"] = self._camera
        return [str(word) for pair in named.items() for word in pair]
