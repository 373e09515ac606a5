"""Motions that are stopped: drives at full speed that brake."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from default_boom import motion_of

from boom_twin import Scene
from boom_twin.scene.pump_pulses import ease
from boom_twin.validation.study.stability_cases import FULL_STROKE, ease_integral

RAMP, STOP = 0.3, 1.0  # s, until full speed; begin of braking


@dataclass(frozen=True)
class StopMotion:
    """Strokes that reach full speed within `ramp`, brake from `stop` on within `brake` (s), and hold. n cylinders.

    From joint `angles` (rad) of the undeformed boom; `first` strokes (m) and full `speed` (m/s), each (n,).
    """

    angles: np.ndarray
    first: np.ndarray
    speed: np.ndarray
    brake: float
    ramp: float = RAMP
    stop: float = STOP

    @property
    def still(self) -> float:
        """Time from which the drives hold, s."""
        return self.stop + self.brake

    @property
    def last(self) -> np.ndarray:
        """Strokes (m) in the end, shape (n,)."""
        return np.asarray(self(np.array([self.still]))[0][0])

    def __call__(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        x, y = np.clip(times / self.ramp, 0.0, 1.0), np.clip((times - self.stop) / self.brake, 0.0, 1.0)
        cruise = np.clip(times, self.ramp, self.stop) - self.ramp
        gone = self.ramp * ease_integral(x) + cruise + self.brake * (y - ease_integral(y))
        return self.first + np.outer(gone, self.speed), np.outer(ease(x) - ease(y), self.speed)


def halt(scene: Scene, posture: str | None, brake: float, only: int | None = None) -> StopMotion:
    """Full speed in the directions of the study's motion, no farther than it goes; `only` one cylinder (from 0): up to half."""
    own = motion_of(scene, posture)
    full = np.array([joint.cylinder.max_stroke for joint in scene.joints]) / FULL_STROKE
    travel = np.where(np.arange(len(full)) == only, 0.5 * full, 0.0) if only is not None else own.travel
    lasting = STOP - 0.5 * RAMP + 0.5 * brake
    speed = np.sign(travel) * np.minimum(full, np.abs(travel) / lasting)
    return StopMotion(own.angles, own.first, speed, brake)
