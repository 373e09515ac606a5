"""Natural frequencies of the model in the present posture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..analysis.frequencies import natural_modes
from ..analysis.statics import settle
from ..errors import BoomTwinError
from ..plan.compile import compile_scene
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.parts import Scene

COUNT = 6
WIDTH = 1e-4
"""Relative accuracy of the frequencies."""
MOVED = 0.005
"""m of any stroke after which they are worked out anew."""


class Modes:
    """Frequencies of one boom, worked out anew where it has moved."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._plan = scene, compile_scene(scene)
        self._at: np.ndarray | None = None
        self._found: list[float] = []

    def at(self, strokes: Sequence[float]) -> list[float]:
        """The lowest `COUNT` frequencies (Hz) about the equilibrium at `strokes` (m); none where there is no equilibrium."""
        now = np.asarray(strokes, dtype=np.float64)
        if self._at is None or np.max(np.abs(now - self._at)) > MOVED:
            self._found, self._at = self._work_out(now), now
        return self._found

    def _work_out(self, strokes: np.ndarray) -> list[float]:
        state, work = self._plan.state(), self._plan.work()
        try:
            settle(self._plan, state, work, strokes, joint_angles_of_strokes(self._scene, strokes))
        except BoomTwinError:
            return []
        return [mode.frequency for mode in natural_modes(self._plan, state, work, COUNT, WIDTH)]
