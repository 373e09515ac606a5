"""Definition of the stability study: its methods, its cases (scenes, motions, steps), and the bounds of a verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from ...analysis.methods import Drive, Method, MethodRun, Motion, integrate_with, motion_of
from ...scene.kinematics import joint_angles_of_strokes, stroke_curve, stroke_range
from ...scene.load import load_scene
from ...scene.pump_pulses import ease
from ...scene.schema import Scene
from ...types import Array
from . import scenes as made

METHODS: dict[str, Method] = {
    "default": Method(),
    "rho 1": Method(parameter=1.0),
    "rho 0.5": Method(parameter=0.5),
    "rho 0": Method(parameter=0.0),
    "Newmark 0.5": Method("newmark", 0.5),
    "Newmark 0.6": Method("newmark", 0.6),
    "Wilson 1.4": Method("wilson", 1.4),
    "Houbolt": Method("houbolt"),
    "Park": Method("park"),
    "single pass": Method(passes=1),
    "plain product": Method(product="plain"),
}

FULL_STROKE = 10.0  # s, duration of a full stroke at full speed


@dataclass(frozen=True)
class Setup:
    """Scene, drive and steps of a case."""

    scene: Scene
    drive: Drive
    angles: Array  # (n,), approximate joint angles (rad) at the start
    duration: float  # s
    step: float
    still: float  # time (s) after which the drives stand still
    jump: float = math.nan  # time (s) of a jump in speed, or NaN; accelerations and forces are impulses there, without a value

    def march(self, step: float, every: int, method: Method) -> MethodRun:
        """Integrate the motion by a method with this `step` (s); keep each row that is a multiple of `every`."""
        return integrate_with(self.scene, self.drive, self.duration, step, every, method, angles=self.angles)


@dataclass(frozen=True)
class DeadStop:
    """Drive from strokes `first` (m) with `ramp` (s) to `speed` (m/s), both (n,), and a dead stop at `stop` (s)."""

    first: Array
    speed: Array
    ramp: float
    stop: float

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Return strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        moving = times < self.stop - 1e-9
        x = np.clip(times / self.ramp, 0.0, 1.0)
        gone = self.ramp * ease_integral(x) + np.clip(times, self.ramp, self.stop) - self.ramp
        rate = np.where(moving, ease(x), 0.0)
        return self.first + np.outer(gone, self.speed), np.outer(rate, self.speed)


def ease_integral(x: Array) -> Array:
    return 2.5 * x**4 - 3.0 * x**5 + x**6


def smooth(
    scene: Scene, posture: str | None = None, share: float = 1.0, rise: float = 1.0, duration: float = 2.0, step: float = 1e-3
) -> Setup:  # fmt: skip
    """Move by `share` of the study's move in `rise` (s), then rest until `duration` (s)."""
    own = motion_of(scene, posture)
    move = replace(own, travel=share * own.travel, rise=rise, duration=duration)
    return Setup(scene, move, own.angles, duration, step, rise)


def move_in_words(scene: Scene) -> str:
    travel = motion_of(scene).travel
    return "from rest, " + ", ".join(f"stroke {i + 1} by {1e3 * travel[i]:+.1f} mm" for i in np.flatnonzero(travel))


def first_cylinder(scene: Scene, posture: str, turn: float, step: float, rise: float = 1.0, duration: float = 2.0) -> Setup:
    """Turn joint 1 by `turn` (rad) in `rise` (s) by its cylinder, then rest."""
    angle = motion_of(scene, posture).angles[0]
    first, last = stroke_curve(scene, 0, np.array([angle, angle + turn]))
    return one_cylinder(scene, posture, 0, float(last - first), step, rise, duration)


def one_cylinder(
    scene: Scene, posture: str, index: int, travel: float, step: float = 1e-3, rise: float = 1.0, duration: float = 2.0
) -> Setup:
    """Move cylinder `index` by `travel` (m) in `rise` (s), then rest."""
    own = motion_of(scene, posture)
    far = np.zeros(len(own.first))
    far[index] = travel
    return Setup(scene, replace(own, travel=far, rise=rise, duration=duration), own.angles, duration, step, rise)


def dead_stop(scene: Scene, step: float = 1e-3) -> Setup:
    """Move as in the study, at full speed from 0.3 s, stop dead at 0.8 s and rest until 2 s."""
    own = motion_of(scene)
    full = np.array([joint.cylinder.max_stroke for joint in scene.joints]) / FULL_STROKE
    drive = DeadStop(own.first, np.sign(own.travel) * full, 0.3, 0.8)
    return Setup(scene, drive, own.angles, 2.0, step, 0.8, jump=0.8)


def to_the_ends(scene: Scene, longest: bool) -> Setup:
    """Move all cylinders from near their longest or shortest allowed stroke to that stroke."""
    ends = np.array([stroke_range(scene, i, 1001) for i in range(len(scene.joints))])
    last, other = (ends[:, 1], ends[:, 0]) if longest else (ends[:, 0], ends[:, 1])
    first = last + 0.05 * (other - last)
    move = Motion("to the ends", joint_angles_of_strokes(scene, first), first, last - first, 1.0, 2.0)
    return Setup(scene, move, move.angles, 2.0, 1e-3, 1.0)


Truth = Literal["fine steps", "equilibrium", "swing", "none"]
"""Reference of a case: the default method at an eighth of the step; the equilibrium of the last strokes; a vibration that does
not grow about a mean that stays; nothing, because there is no solution."""


@dataclass(frozen=True)
class Case:
    """One row of the matrix."""

    group: str
    name: str
    varied: str  # how scene, motion or step are derived
    make: Callable[[], Setup]  # returns the `Setup`
    truth: Truth = "fine steps"
    quick: bool = False  # whether it belongs to the quick subset


def short(value: float) -> str:
    """Return a digit times a power of ten as text: 1e-6, 5e-2, 1e13."""
    digit, _, power = f"{value:.0e}".partition("e")
    return f"{digit}e{int(power)}"


STIFFNESSES = (1e5, 1e6, 1e7, 1e8, 1e9, 1e11, 1e13)  # N/m
FACTORS = (1e-3, 1e-2, 1e-1, 1e1, 1e2, 1e3, 1e4)
STEPS = (  # step, rise, duration (s), share of the move
    (1e-6, 0.01, 0.02, 0.05), (1e-5, 0.05, 0.1, 0.05), (1e-4, 0.2, 0.4, 0.05), (1e-3, 1.0, 2.0, 1.0), (5e-3, 1.0, 2.0, 1.0),
    (2e-2, 2.0, 4.0, 1.0), (5e-2, 4.0, 8.0, 1.0),
)  # fmt: skip
TEN_MINUTES, LARGE_STEP = 600.0, 2e-2  # s


def cases(scene: Scene) -> tuple[Case, ...]:
    """Return all cases of a scene; those with a geometry of their own take the default boom."""
    found = (
        Case("scene", "as it is", "nothing", partial(smooth, scene), quick=True),
        *_stiffness(scene), *_masses(scene), *_steps(scene), *_sections(), *_geometry(scene),
        *_dead_centres(), *_stops(scene), *_holds(scene), *_payload_and_modes(scene),
    )  # fmt: skip
    return tuple(found)


def _stiffness(scene: Scene) -> Iterator[Case]:
    group = "oil stiffness"
    for k in STIFFNESSES:
        make = partial(smooth, made.cylinders(scene, k))
        yield Case(group, f"k {short(k)} N/m", "all cylinders", make, quick=k in (STIFFNESSES[0], STIFFNESSES[-1]))
    yield Case(group, "incompressible", "cylinders without k", partial(smooth, made.cylinders(scene, None)), quick=True)
    group = "bending stiffness"
    hanging = made.posed(made.bending(load_scene(), FACTORS[0]), (0.0, -90.0, -90.0, -90.0))
    yield Case(group, "EI x 1e-3, hanging", "default boom, sections 2 to 4 hang", partial(smooth, hanging, "case", 0.4))
    for factor in FACTORS:
        make = partial(smooth, made.bending(scene, factor))
        yield Case(group, f"EI x {short(factor)}", "all sections", make, quick=factor in (FACTORS[0], FACTORS[-1]))
    yield Case(group, "rigid", "no section bends", partial(smooth, made.with_modes(scene, 0)))
    stiffest = made.cylinders(made.bending(scene, FACTORS[-1]), STIFFNESSES[-1])
    yield Case(group, "EI x 1e4, k 1e13", "all sections and cylinders", partial(smooth, stiffest))


def _masses(scene: Scene) -> Iterator[Case]:
    group = "small masses"
    for factor in (1e-6, 0.0):
        shown = f"x {short(factor)}" if factor else "0"
        yield Case(group, f"links {shown}", "mL, mR", partial(smooth, made.links(scene, factor)))
        for key in ("barrel", "rod"):
            lighter = made.cylinder_parts(scene, (key,), factor)
            yield Case(group, f"{key}s {shown}", "mass and inertia", partial(smooth, lighter))
        bare = made.cylinder_parts(made.links(scene, factor), ("barrel", "rod"), factor)
        yield Case(group, f"all three {shown}", "links, barrels and rods", partial(smooth, bare), quick=factor == 0.0)


def _steps(scene: Scene) -> Iterator[Case]:
    for step, rise, duration, share in STEPS:
        make = partial(smooth, scene, None, share, rise, duration, step)
        yield Case("time step", f"dt {short(step)} s", f"{share:g} of the move in {rise:g} s", make, quick=step >= 2e-2)
    yield Case("time step", "dt 5e-2 s, fast", "the move in 1 s", partial(smooth, scene, None, 1.0, 1.0, 4.0, 5e-2))


def _sections() -> Iterator[Case]:
    for count in (2, 3, 5, 10, 20, 50, 100, 200):
        make = partial(_long, count)
        yield Case("length", f"{count} sections", "20 m in all, cylinder 1 moves, dt 1 ms", make, quick=count in (2, 20))
    yield Case("length", "101 m", "seven sections, cylinder 1 moves, dt 5 ms", partial(_large), quick=True)


def _long(count: int) -> Setup:
    return first_cylinder(made.long_boom(count), "test", 0.03, 1e-3, 0.5, 1.0 if count <= 20 else 0.6)


def _large() -> Setup:
    return first_cylinder(made.seven_sections(), "test", 0.05, 5e-3, duration=4.0)


def _geometry(scene: Scene) -> Iterator[Case]:
    group, folded = "geometry", made.posed(load_scene(), (80.0, -80.0, -240.0, -400.0))
    yield Case(group, "shortest strokes", "all cylinders go there", partial(to_the_ends, scene, False))
    yield Case(group, "longest strokes", "all cylinders go there", partial(to_the_ends, scene, True))
    yield Case(group, "fully folded", "default boom", partial(smooth, folded, "case", 0.3), quick=True)


def _dead_centres() -> Iterator[Case]:
    """Yield cases of joint 2 of the default boom: dead centre of its cylinder at -170 deg, links in line at -174.2 deg."""
    group, boom = "dead centre", load_scene()
    near, before, beyond = (made.freed(boom, 1, -178.0, 0.6, angle) for angle in (-168.0, -165.0, -172.0))
    stiff, toggle = (made.with_modes(made.cylinders(own, None), 0) for own in (before, beyond))
    yield Case(group, "near", "joint 2 at -168 of -170 deg", _second(near, -2e-3))
    yield Case(group, "pushed over", "cylinder 2 by 3 mm past it", _second(before, 8e-3))
    yield Case(group, "beyond", "weight on the wrong side", _second(beyond, -2e-3), "none", True)
    yield Case(group, "no way past", "rigid, cylinder 2 by 3 mm past it", _second(stiff, 8e-3), "none", True)
    yield Case(group, "near the toggle", "rigid, links up to 0.3 deg from a line", _second(toggle, -2e-2))


def _second(scene: Scene, travel: float) -> Callable[[], Setup]:
    return partial(one_cylinder, scene, "case", 1, travel)


def _stops(scene: Scene) -> Iterator[Case]:
    group, stops = "dead stop", "the drives stop dead at full speed"
    yield Case(group, "as it is", stops, partial(dead_stop, scene), quick=True)
    yield Case(group, "k 1e11 N/m", stops, partial(dead_stop, made.cylinders(scene, 1e11)))
    yield Case(group, "incompressible", stops, partial(dead_stop, made.cylinders(scene, None)))
    yield Case(group, "rigid sections", stops, partial(dead_stop, made.with_modes(scene, 0)))
    yield Case(group, "dt 2e-2 s", stops, partial(dead_stop, scene, LARGE_STEP))


def _holds(scene: Scene) -> Iterator[Case]:
    make = partial(smooth, scene, None, 1.0, 1.5, TEN_MINUTES, LARGE_STEP)
    yield Case("hold", "10 min", "dt 20 ms, after the move", make, "equilibrium", True)
    free = partial(smooth, made.undamped(scene), None, 1.0, 1.5, TEN_MINUTES, LARGE_STEP)
    yield Case("hold", "10 min, undamped", "dt 20 ms, after the move, no beta and no d", free, "swing", True)
    stiff = partial(smooth, made.undamped(made.cylinders(scene, None)), None, 1.0, 1.5, TEN_MINUTES, LARGE_STEP)
    yield Case("hold", "10 min, incompressible", "dt 20 ms, after the move, no k, no damping", stiff, "swing")


def _payload_and_modes(scene: Scene) -> Iterator[Case]:
    for share in (0.1, 1.0, 3.0, 10.0):
        make = partial(smooth, made.loaded(scene, share))
        yield Case("payload", f"{share:g} x boom", "of the boom's mass, at the tip", make, quick=share == 10.0)
    for count in (1, 2, 4, 6, 8, 10):
        make = partial(smooth, made.with_modes(scene, count))
        yield Case("modes", f"{count} a part", "bending coordinates", make, quick=count == 10)


Word = Literal["holds", "degrades", "fails", "refuses"]


@dataclass(frozen=True)
class Facts:
    """Deviations of a motion from its reference. A quantity that does not apply to the case is NaN."""

    status: str  # "ok", or the reason for an early end of the motion
    solvable: bool = True  # True if a solution exists
    doubt: str = ""  # warning of the simulation, see `analysis.doubts`
    error: float = math.nan  # largest tip error, relative to the tip's path
    acceleration: float = math.nan  # rms error of the tip acceleration, relative to its rms
    force: float = math.nan  # rms error of the cylinder forces, relative to the largest
    ringing: float = math.nan  # rms of what alternates from step to step while the drives hold, relative to the peak
    force_ringing: float = math.nan  # likewise of the cylinder forces
    growth: float = math.nan  # ratio of vibration in the last quarter of the hold to the first, relative to the reference's
    drift: float = math.nan  # distance from equilibrium, or shift of the mean, after a long hold, over the path
    lasting: float = math.nan  # steps after a speed jump until cylinder forces are correct again
    passes: float = math.nan  # of Newton's method per step

    @property
    def verdict(self) -> CaseVerdict:
        """Return the verdict by `BOUNDS`. Infinite values exceed every bound; NaN exceeds none."""
        if self.status != "ok":
            return CaseVerdict("fails" if self.solvable else "refuses", self.status)
        warned = f" (it says: {self.doubt})" if self.doubt else ""
        if not self.solvable:
            return CaseVerdict("fails", "gives numbers where there is no solution" + warned, silent=not self.doubt)
        failing, degrading = list[str](), list[str]()
        for name, (degrades, fails, symptom) in BOUNDS.items():
            value = getattr(self, name)
            beyond = failing if value > fails or math.isinf(value) else degrading if value > degrades else None
            if beyond is not None:
                beyond.append(symptom.format(f"{float(f'{value:.2g}'):g}"))
        if not failing and not degrading:
            return CaseVerdict("holds", "")
        return CaseVerdict(
            "fails" if failing else "degrades", "; ".join(failing + degrading) + warned, bool(failing) and not self.doubt
        )


@dataclass(frozen=True)
class CaseVerdict:
    """Verdict with its symptom. `silent` is True if the numbers are wrong without a bad status or a warning."""

    word: Word
    symptom: str
    silent: bool = False

    @property
    def mark(self) -> str:
        return "silent" if self.silent else self.word


# quantity: (degrades above, fails above, symptom)
BOUNDS: dict[str, tuple[float, float, str]] = {
    "error": (1e-2, 1e-1, "tip wrong by {} of its path"),
    "acceleration": (5e-2, 1.0, "tip acceleration wrong by {} of its rms"),
    "force": (1e-2, 1e-1, "cylinder forces wrong by {} of the largest"),
    "drift": (1e-4, 1e-2, "tip drifts by {} of its path"),
    "growth": (1.2, 3.0, "vibration grows {}-fold while the drives hold"),
    "ringing": (2e-2, 0.5, "tip acceleration rings from step to step, {} of its peak"),
    "force_ringing": (2e-2, 0.5, "cylinder forces ring from step to step, {} of their peak"),
    "lasting": (10.0, math.inf, "cylinder forces are wrong for {} steps after the jump of speed"),
    "passes": (6.0, math.inf, "slow Newton: {} passes a step"),
}
