"""Clearance study: its effect at rest, its effect after a stop, and its cost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from compiled import rest_at
from default_boom import motion_of, posture_angles, strokes_of_posture
from studies.stops import StopMotion, halt

from boom_twin import Scene, statics
from boom_twin.analysis.methods import MethodRun, integrate_with
from boom_twin.scene.schema import IDEAL_BELOW

from .scenes import Treatment, ideal, pin_like, rods_and_joints, treated, with_pins

WIDEST = 1e-3  # m
NUDGE = 1e-4  # m
COUNT, QUICK_COUNT = 13, 3


@dataclass(frozen=True)
class Shift:
    """Tip at rest with play in one rod's pin against ideal pins. k clearances, falling to `IDEAL_BELOW`."""

    posture: str
    pin: str
    clearances: np.ndarray  # (k,), m
    shifts: np.ndarray  # (k,), m, distance of the tips
    penetrations: np.ndarray  # (k,), m, how far the journal presses into the bush
    loaded: float  # the tip's way for the cylinder's, of the loaded elastic boom with ideal pins

    @property
    def jump(self) -> float:
        """Jump of the tip at the switch to the ideal pin, m."""
        return float(self.shifts[-1])

    @property
    def ratios(self) -> np.ndarray:
        """Shifts over loaded lever x (clearance + penetration), shape (k,)."""
        return np.asarray(self.shifts / (self.loaded * (self.clearances + self.penetrations)))


def shifts(scene: Scene, postures: tuple[str, ...], count: int = COUNT) -> list[Shift]:
    """Every cylinder in every posture."""
    contact, found = treated(scene, "contact"), []
    for posture in postures:
        tip = _rest(ideal(scene), posture)[0]
        for i in range(len(scene.joints)):
            found.append(_shift(contact, posture, i, _loaded(ideal(scene), posture, i), tip, count))
    return found


def _shift(scene: Scene, posture: str, index: int, loaded: float, tip: np.ndarray, count: int) -> Shift:
    clearances = np.geomspace(WIDEST, IDEAL_BELOW, count)
    clearances[-1] = IDEAL_BELOW
    name = f"cylinder_{index + 1}.rod"
    rests = [_rest(with_pins(scene, [pin_like(scene, name, float(c))]), posture) for c in clearances]
    pins = np.array([pin[0] for _, pin in rests])
    return Shift(
        posture, name, clearances, np.array([np.hypot(*(own - tip)) for own, _ in rests]),
        np.hypot(pins[:, 0], pins[:, 1]) - clearances, loaded,
    )  # fmt: skip


def _loaded(scene: Scene, posture: str, index: int) -> float:
    """Way of the resting tip per metre of stroke `index`, by central differences."""
    ways = [_rest(scene, posture, side * NUDGE * np.eye(len(scene.joints))[index])[0] for side in (-1.0, 1.0)]
    return float(np.hypot(*(ways[1] - ways[0])) / (2.0 * NUDGE))


def _rest(scene: Scene, posture: str, more: float | np.ndarray = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Tip (2,) in m, pins (k, 4) as in `compiler.plan`."""
    plan, state, _ = rest_at(scene, strokes_of_posture(scene, posture) + more, posture_angles(scene, posture))
    found = plan.observed(state)
    return found.tip[0, :2], found.pins


STEP = 1e-3  # s
HOLD, QUICK_HOLD = 15.0, 0.9  # s after the stop
BRAKE = 0.1  # s
MODELS = ("ideal", "contact", "spring-damper")


@dataclass(frozen=True)
class Swing:
    """The tip after a stop, in one posture with one kind of pins. m rows; heights over the rest with ideal pins at the end."""

    posture: str
    model: str
    times: np.ndarray  # (m,), s from the stop: the drives hold from 0
    height: np.ndarray  # (m,), m
    acceleration: np.ndarray  # (m,), m/s^2, vertical
    rest: float  # m, height at rest at the end
    peak: float  # m, largest distance from that rest after the stop
    effective: float  # m/s^2, root mean square of the vertical acceleration after the stop


def swings(scene: Scene, postures: tuple[str, ...], hold: float = HOLD) -> list[Swing]:
    """Every posture with ideal pins, contact and linearised pins."""
    found = []
    for posture in postures:
        drive = halt(scene, posture, BRAKE)
        scenes = (ideal(scene), treated(scene, "contact"), treated(scene, "spring-damper"))
        reference = _rest_of(scenes[0], drive)
        for model, one in zip(MODELS, scenes, strict=True):
            moved = integrate_with(one, drive, drive.still + hold, STEP, angles=drive.angles)
            # a linearised pin belongs to the rest at the start; at the end contact says where it lies
            rest = _rest_of(scenes[1] if model != "ideal" else one, drive)
            found.append(_swing(posture, model, moved, drive, rest - reference, reference))
    return found


def _rest_of(scene: Scene, drive: StopMotion) -> float:
    """Height (m) of the tip at rest where the drives have stopped."""
    return float(statics(scene, strokes=drive.last, modes=0).tip[1])


def _swing(posture: str, model: str, moved: MethodRun, drive: StopMotion, rest: float, reference: float) -> Swing:
    times, height, acceleration = moved.times - drive.still, moved.tip[:, 1] - reference, moved.tip_acceleration[:, 1]
    after = times >= -1e-9
    off = height[after] - (rest if model != "spring-damper" else float(np.mean(height[after])))
    peak = float(np.abs(off).max())
    effective = float(np.sqrt(np.mean(acceleration[after] ** 2)))
    return Swing(posture, model, times, height, acceleration, rest, peak, effective)


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


def costs(scene: Scene, quick: bool = False) -> list[Cost]:
    """Return costs of play in no pin, the first rod's, all rods', and all joints' too; least of several runs that lie apart."""
    cases = list(_cases(scene))
    gentle, least = QUICK_GENTLE if quick else GENTLE, np.full((len(cases), 2), np.inf)
    for _ in range(QUICK_REPEATS if quick else REPEATS):
        least = np.minimum(least, [_seconds(one, gentle) for _, _, one in cases])
    rows = zip(cases, (least * STEP / (gentle, VIOLENT)).tolist(), strict=True)
    return [Cost(count, name, *times) for (count, name, _), times in rows]


def _cases(scene: Scene) -> Iterator[tuple[int, str, Scene]]:
    yield 0, "ideal", ideal(scene)
    names = rods_and_joints(scene)
    for treatment in TREATMENTS:
        for count in sorted({1, len(scene.joints), len(names)}):
            own = [pin_like(scene, name) for name in names[:count]]
            yield count, treatment, treated(with_pins(scene, own), treatment)


def _seconds(scene: Scene, gentle: float) -> list[float]:
    """Run times (s) of both motions."""
    move = motion_of(scene)
    hard = replace(halt(scene, None, HARD_BRAKE), ramp=RAMP, stop=STOP)  # harder than any operator would make it
    runs = ((move, gentle), (hard, VIOLENT))
    return [integrate_with(scene, drive, span, STEP, round(span / STEP), angles=move.angles).seconds for drive, span in runs]
