"""What a pin with clearance costs: time of a step by their number, in a gentle move and after a violent stop."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..analysis.march import march
from ..scene.parts import Scene
from .clearance_scenes import Treatment, ideal, pin_like, rods_and_joints, treated, with_pins
from .halt import Halt, halt
from .motion import motion_of

STEP = 1e-3  # s
GENTLE, QUICK_GENTLE = 2.0, 0.2  # s
RAMP, STOP, HARD_BRAKE, VIOLENT = 0.05, 0.1, 0.01, 0.3  # s: full speed, stop, its length, end
REPEATS, QUICK_REPEATS = 7, 1
TREATMENTS: tuple[Treatment, ...] = ("contact", "spring-damper")


@dataclass(frozen=True)
class Cost:
    """Time (s) of a step of 1 ms: in the gentle move, and in the violent start and stop."""

    pins: int
    treatment: str
    gentle: float
    violent: float

    @property
    def factors(self) -> tuple[float, float]:
        """Real time over run time, of both."""
        return STEP / self.gentle, STEP / self.violent


def costs(scene: Scene, posture: str | None, quick: bool = False) -> list[Cost]:
    """No pin, the first rod's, all rods', and those of all joints too; least of several runs that lie apart."""
    cases = list(_cases(scene))
    gentle, least = QUICK_GENTLE if quick else GENTLE, np.full((len(cases), 2), np.inf)
    for _ in range(QUICK_REPEATS if quick else REPEATS):
        least = np.minimum(least, [_seconds(one, posture, gentle) for _, _, one in cases])
    rows = zip(cases, (least * STEP / (gentle, VIOLENT)).tolist(), strict=True)
    return [Cost(count, name, *times) for (count, name, _), times in rows]


def violent(scene: Scene, posture: str | None) -> Halt:
    """To full speed and to a stop as no operator would."""
    return replace(halt(scene, posture, HARD_BRAKE), ramp=RAMP, stop=STOP)


def _cases(scene: Scene) -> Iterator[tuple[int, str, Scene]]:
    yield 0, "ideal", ideal(scene)
    names = rods_and_joints(scene)
    for treatment in TREATMENTS:
        for count in sorted({1, len(scene.joints), len(names)}):
            own = [pin_like(scene, name) for name in names[:count]]
            yield count, treatment, treated(with_pins(scene, own), treatment)


def _seconds(scene: Scene, posture: str | None, gentle: float) -> list[float]:
    """Run times (s) of both motions."""
    move = motion_of(scene, posture)
    runs = ((move, gentle), (violent(scene, posture), VIOLENT))
    return [march(scene, drive, span, STEP, round(span / STEP), angles=move.angles).seconds for drive, span in runs]
