"""Error of the tip over ever smaller steps: where it stops to fall with the square of the step, since round-off takes over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.march import Method, march
from ..records import Array
from ..scene.parts import Scene
from .stability_motions import smooth

SPAN, RISE, SHARE, ROWS = 0.2, 0.16, 0.1, 10  # s, s, of the study's move, rows compared
TURN_UP_STEPS = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5, 5e-6, 2e-6, 1e-6)  # s
COARSE, FINE = 2e-5, 1e-5  # s, steps that the reference is extrapolated from
FITTED = 1e-4  # s, the order is fitted down to this step
TARGET = 1e-8  # of the boom's length: above it the error may not turn up


@dataclass(frozen=True)
class TurnUp:
    """Errors of the tip. k steps.

    Attributes
    ----------
    steps : ndarray, shape (k,)
        s, falling.
    errors : ndarray, shape (k,)
        Largest error of the tip over `length`.
    accelerations : ndarray, shape (k,)
        Error of the tip's acceleration, rms, m/s^2.
    length : float
        Of the boom, m.
    order : float
        Fitted where the scheme's error prevails.
    """

    steps: Array
    errors: Array
    accelerations: Array
    length: float
    order: float

    @property
    def floor(self) -> tuple[float, float]:
        """Step (s) with the smallest error, and that error."""
        best = int(np.argmin(self.errors))
        return float(self.steps[best]), float(self.errors[best])

    @property
    def turned_up_above_target(self) -> bool:
        """Whether the error rises again before it has been below `TARGET`."""
        rises = np.flatnonzero(np.diff(self.errors) > 0.0)
        return bool(rises.size and self.errors[rises[0]] > TARGET)


def turn_up(scene: Scene, steps: tuple[float, ...] = TURN_UP_STEPS, method: Method | None = None) -> TurnUp:
    """March a short smooth move by all `steps` (s), among them `COARSE` and `FINE`."""
    found = {step: _rows(scene, step, method) for step in steps}
    weight = FINE**2 / (COARSE**2 - FINE**2)
    right = [fine + weight * (fine - coarse) for fine, coarse in zip(found[FINE], found[COARSE], strict=True)]
    length = sum(section.length for section in scene.sections)
    errors = np.array([np.linalg.norm(found[step][0] - right[0], axis=1).max() for step in steps]) / length
    rough = np.array([np.sqrt(np.mean((found[step][1] - right[1]) ** 2)) for step in steps])
    taken = np.array(steps) >= FITTED
    order = np.polyfit(np.log(np.array(steps)[taken]), np.log(errors[taken]), 1)[0]
    return TurnUp(np.array(steps), errors, rough, length, float(order))


def _rows(scene: Scene, step: float, method: Method | None) -> tuple[Array, Array]:
    """Tip and its acceleration, both (ROWS + 1, 2), m and m/s^2."""
    own = smooth(scene, None, SHARE, RISE, SPAN, step)
    found = march(scene, own.drive, SPAN, step, round(SPAN / ROWS / step), method, angles=own.angles)
    return found.tip, found.tip_acceleration
