"""Natural frequencies of a boom in its posture, computed again only when it has moved."""

from __future__ import annotations

import threading
from collections.abc import Sequence

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

MODE_DISTANCE = 0.2  # relative distance up to which a measured frequency belongs to a mode of the model


def nearest_mode(frequency: float, model: Sequence[float]) -> int | None:
    """Return the index of the mode of the model (frequencies in Hz) nearest to a measured one; None if none is near."""
    mode = min(range(len(model)), key=lambda i: abs(model[i] - frequency), default=None)
    return mode if mode is not None and abs(model[mode] - frequency) <= MODE_DISTANCE * model[mode] else None


class ModeList:
    """Lowest `COUNT` natural frequencies (Hz) about the equilibrium; none where there is no equilibrium."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._plan = scene, compile_scene(scene)
        self._at: Array | None = None
        self._found: list[float] = []
        self._one_at_a_time = threading.Lock()  # a thread goes on when the viewer that waited for it has gone

    def at(self, strokes: Sequence[float]) -> list[float]:
        """Return the frequencies at `strokes` (m), the same object as before if no stroke has moved by `MOVED`."""
        now = np.asarray(strokes, dtype=np.float64)
        with self._one_at_a_time:
            if self._at is None or np.max(np.abs(now - self._at)) > MOVED:
                self._found, self._at = self._frequencies(now), now
            return self._found

    def _frequencies(self, strokes: Array) -> list[float]:
        frequency_accuracy = 1e-4  # relative accuracy of the frequencies
        state, work = self._plan.state(), self._plan.work()
        try:
            settle(self._plan, state, work, strokes, joint_angles_of_strokes(self._scene, strokes))
        except BoomTwinError:
            return []
        return [mode.frequency for mode in natural_modes(self._plan, state, work, COUNT, frequency_accuracy)]
