"""Results that depend on a boom's posture alone, computed again only when it has moved; its natural frequencies."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Generic, TypeVar

import numpy as np

from ..compiler.compile import compile_scene
from ..errors import BoomTwinError
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.schema import Scene
from ..types import Array
from .equilibrium import settle
from .modal import natural_modes

MOVED = 0.005  # m of any stroke after which all is computed anew
COUNT = 6

Found = TypeVar("Found")


class PresentPosture(Generic[Found]):
    """Result that depends on the strokes of one boom, computed again when it has moved by `MOVED`."""

    def __init__(self) -> None:
        self._at: Array | None = None
        self._found: Found | None = None
        self._one_at_a_time = threading.Lock()  # a thread goes on when the viewer that waited for it has gone

    def at(self, strokes: Sequence[float]) -> Found:
        """Return the result at `strokes` (m), the same object as before if the boom has not moved."""
        now = np.asarray(strokes, dtype=np.float64)
        with self._one_at_a_time:
            if self._found is None or self._at is None or np.max(np.abs(now - self._at)) > MOVED:
                self._found, self._at = self._work_out(now), now
            return self._found

    def _work_out(self, strokes: Array) -> Found:
        raise NotImplementedError


class ModeList(PresentPosture[list[float]]):
    """Lowest `COUNT` natural frequencies (Hz) about the equilibrium; none where there is no equilibrium."""

    def __init__(self, scene: Scene) -> None:
        super().__init__()
        self._scene, self._plan = scene, compile_scene(scene)

    def _work_out(self, strokes: Array) -> list[float]:
        frequency_accuracy = 1e-4  # relative accuracy of the frequencies
        state, work = self._plan.state(), self._plan.work()
        try:
            settle(self._plan, state, work, strokes, joint_angles_of_strokes(self._scene, strokes))
        except BoomTwinError:
            return []
        return [mode.frequency for mode in natural_modes(self._plan, state, work, COUNT, frequency_accuracy)]
