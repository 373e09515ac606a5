"""What a pin with clearance costs: time of a step by their number, in a gentle move and after a violent stop."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ..analysis.march import Drive, march
from ..records import Array
from ..scene.parts import Scene
from .clearance_scenes import Treatment, ideal, pin_like, rods_and_joints, treated, with_pins
from .halt import halt
from .motion import motion_of

STEP = 1e-3  # s
GENTLE, QUICK_GENTLE = 2.0, 0.2  # s
BRAKE = 0.01  # s, of a violent stop
BURST = 0.2  # s from the stop on
REPEATS, QUICK_REPEATS = 7, 1
TREATMENTS: tuple[Treatment, ...] = ("contact", "spring-damper")


@dataclass(frozen=True)
class Cost:
    """Time (s) of a step of 1 ms: in the gentle move, and in the first `BURST` after the violent stop."""

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
    found = [(float("inf"), float("inf"))] * len(cases)
    for _ in range(QUICK_REPEATS if quick else REPEATS):
        now = [_times(one, posture, QUICK_GENTLE if quick else GENTLE) for _, _, one in cases]
        found = [(min(a, c), min(b, d)) for (a, b), (c, d) in zip(found, now, strict=True)]
    return [Cost(count, name, *times) for (count, name, _), times in zip(cases, found, strict=True)]


def _cases(scene: Scene) -> Iterator[tuple[int, str, Scene]]:
    yield 0, "ideal", ideal(scene)
    names = rods_and_joints(scene)
    for treatment in TREATMENTS:
        for count in sorted({1, len(scene.joints), len(names)}):
            own = [pin_like(scene, name) for name in names[:count]]
            yield count, treatment, treated(with_pins(scene, own), treatment)


def _times(scene: Scene, posture: str | None, gentle: float) -> tuple[float, float]:
    move, stop = motion_of(scene, posture), halt(scene, posture, BRAKE)
    before, after = (_seconds(scene, stop, stop.angles, duration) for duration in (stop.stop, stop.stop + BURST))
    return _seconds(scene, move, move.angles, gentle) / round(gentle / STEP), (after - before) / round(BURST / STEP)


def _seconds(scene: Scene, drive: Drive, angles: Array, duration: float) -> float:
    return march(scene, drive, duration, STEP, round(duration / STEP), angles=angles).seconds
