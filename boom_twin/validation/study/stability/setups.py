"""Set-ups of the stability study: extreme scenes and motions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ....analysis.methods import Drive
from ....analysis.motions import FULL_STROKE, Motion, ease_integral, motion_of
from ....scene.edit import scaled
from ....scene.kinematics import joint_angles_of_strokes, stroke_curve, stroke_range
from ....scene.oil_spring import middle_stiffness
from ....scene.pump_pulses import ease
from ....scene.schema import Cylinder, CylinderPart, Joint, Scene, Section, Tip
from ....scene.summary import explain
from ....types import Array

STEEL_LAG = 3e-3  # s, damping over stiffness of a cylinder that names no stiffness


def cylinders(scene: Scene, stiffness: float | None) -> Scene:
    """All cylinders with this oil stiffness (N/m) and damping in proportion; None: incompressible."""

    def changed(cylinder: Cylinder) -> Cylinder:
        if stiffness is None:
            return cylinder.model_copy(update={"k": None, "oil": None, "d": None})
        lag = (cylinder.d or 0.0) / middle_stiffness(cylinder) if cylinder.is_compressible else STEEL_LAG
        return cylinder.model_copy(update={"k": stiffness, "oil": None, "d": lag * stiffness})

    return _joints(scene, lambda joint: joint.model_copy(update={"cylinder": changed(joint.cylinder)}))


def bending(scene: Scene, factor: float) -> Scene:
    """Return the scene with `factor` times the second moment of area of all sections."""
    return _sections(scene, lambda s: s if s.I is None else s.model_copy(update={"I": factor * s.I}))


def links(scene: Scene, factor: float) -> Scene:
    """Links with `factor` times their mass, where they have one."""

    def changed(joint: Joint) -> Joint:
        named = {key: getattr(joint, key) for key in ("mL", "mR")}
        return joint.model_copy(update={key: factor * mass for key, mass in named.items() if mass is not None})

    return _joints(scene, changed)


def cylinder_parts(scene: Scene, keys: tuple[str, ...], factor: float) -> Scene:
    """Barrels, rods or both (`keys`) with `factor` times their mass and inertia, where there are any."""

    def changed(joint: Joint) -> Joint:
        parts: dict[str, CylinderPart | None] = {key: getattr(joint.cylinder, key) for key in keys}
        update = {key: scaled(part, factor) for key, part in parts.items() if part is not None}
        return joint.model_copy(update={"cylinder": joint.cylinder.model_copy(update=update)})

    return _joints(scene, changed)


def loaded(scene: Scene, share: float) -> Scene:
    """A payload of `share` times the boom's mass."""
    unloaded = scene.model_copy(update={"tip": None})
    return scene.model_copy(update={"tip": Tip(payload=share * explain(unloaded).mass)})


def with_modes(scene: Scene, count: int) -> Scene:
    """Every flexible section with `count` bending coordinates a part; 0 makes all sections rigid."""
    free = _sections(scene, lambda s: s if s.modes in (None, 0) else s.model_copy(update={"modes": None}))
    return free.model_copy(update={"modes": count})


def undamped(scene: Scene) -> Scene:
    """Return the scene without damping in beams and cylinders."""
    calm = _sections(scene, lambda s: s.model_copy(update={"beta": None}))
    return _joints(calm, lambda j: j.model_copy(update={"cylinder": j.cylinder.model_copy(update={"d": None})}))


def lighter_gravity(scene: Scene, share: float) -> Scene:
    """Return the scene with `share` of its gravity."""
    return scene.model_copy(update={"gravity": (share * scene.gravity[0], share * scene.gravity[1])})


def posed(scene: Scene, headings: tuple[float, ...]) -> Scene:
    """Return the scene with a posture ``case`` at section angles `headings` (deg)."""
    return scene.model_copy(update={"postures": {"case": headings}})


def freed(scene: Scene, index: int, low: float, travel: float, relative: float) -> Scene:
    """Joint `index` may turn down to `low` (deg) with a cylinder of `travel` (m); posture ``case`` has it at `relative` (deg).

    The other joints stand as in the posture ``arch``.
    """
    joint = scene.joints[index]
    wide = joint.model_copy(
        update={
            "range_deg": (low, joint.range_deg[1]),
            "cylinder": joint.cylinder.model_copy(update={"max_stroke": travel}),
        }
    )
    turned = np.diff(scene.postures["arch"], prepend=0.0)
    turned[index] = relative
    joints = tuple(wide if i == index else other for i, other in enumerate(scene.joints))
    return posed(scene.model_copy(update={"joints": joints}), tuple(float(angle) for angle in np.cumsum(turned)))


def _sections(scene: Scene, change: Callable[[Section], Section]) -> Scene:
    return scene.model_copy(update={"sections": tuple(change(section) for section in scene.sections)})


def _joints(scene: Scene, change: Callable[[Joint], Joint]) -> Scene:
    return scene.model_copy(update={"joints": tuple(change(joint) for joint in scene.joints)})


SHARE = 0.05  # of a cylinder's travel, from where it goes to the end
SAMPLES = 1001  # of a joint's range


@dataclass(frozen=True)
class Setup:
    """Scene, drive and steps of a case.

    Attributes
    ----------
    scene : Scene
    drive : Drive
    angles : ndarray, shape (n,)
        Joint angles (rad) next to which the boom starts.
    duration, step : float
        s.
    still : float
        s, from here on the drives hold.
    every : int
        Steps to a row.
    jump : float
        When the drives' speed jumps, s; NaN if it does not. Accelerations and forces there are impulses, which have no value.
    """

    scene: Scene
    drive: Drive
    angles: Array
    duration: float
    step: float
    still: float
    every: int = 1
    jump: float = math.nan


@dataclass(frozen=True)
class DeadStop:
    """Strokes `first` (m) that reach `speed` (m/s), both shape (n,), within `ramp` (s) and stop dead at `stop` (s)."""

    first: Array
    speed: Array
    ramp: float
    stop: float

    def __call__(self, times: Array) -> tuple[Array, Array]:
        """Strokes (m) and rates (m/s), each (m, n), at `times` (m,) in s."""
        moving = times < self.stop - 1e-9
        x = np.clip(times / self.ramp, 0.0, 1.0)
        gone = self.ramp * ease_integral(x) + np.clip(times, self.ramp, self.stop) - self.ramp
        rate = np.where(moving, ease(x), 0.0)
        return self.first + np.outer(gone, self.speed), np.outer(rate, self.speed)


def smooth(
    scene: Scene, posture: str | None = None, share: float = 1.0, rise: float = 1.0, duration: float = 2.0, step: float = 1e-3,
    every: int = 1,
) -> Setup:  # fmt: skip
    """`share` of the study's move in `rise` (s), then a hold until `duration` (s)."""
    own = motion_of(scene, posture)
    move = replace(own, travel=share * own.travel, rise=rise, duration=duration)
    return Setup(scene, move, own.angles, duration, step, rise, every)


def move_in_words(scene: Scene) -> str:
    """Strokes of the study's move on a scene."""
    travel = motion_of(scene).travel
    return "from rest, " + ", ".join(f"stroke {i + 1} by {1e3 * travel[i]:+.1f} mm" for i in np.flatnonzero(travel))


def first_cylinder(scene: Scene, posture: str, turn: float, step: float, rise: float = 1.0, duration: float = 2.0) -> Setup:
    """Cylinder 1 turns joint 1 by `turn` (rad) in `rise` (s), then holds."""
    return one_cylinder(scene, posture, 0, _stroke_for(scene, posture, turn), step, rise, duration)


def one_cylinder(
    scene: Scene, posture: str, index: int, travel: float, step: float = 1e-3, rise: float = 1.0, duration: float = 2.0
) -> Setup:
    """Cylinder `index` travels by `travel` (m) in `rise` (s), then holds."""
    own = motion_of(scene, posture)
    far = np.zeros(len(own.first))
    far[index] = travel
    return Setup(scene, replace(own, travel=far, rise=rise, duration=duration), own.angles, duration, step, rise)


def dead_stop(scene: Scene, step: float = 1e-3) -> Setup:
    """The study's move at full speed of the drives, from 0.3 s on, stopped dead at 0.8 s; 2 s in all."""
    own = motion_of(scene)
    full = np.array([joint.cylinder.max_stroke for joint in scene.joints]) / FULL_STROKE
    drive = DeadStop(own.first, np.sign(own.travel) * full, 0.3, 0.8)
    return Setup(scene, drive, own.angles, 2.0, step, 0.8, jump=0.8)


def to_the_ends(scene: Scene, longest: bool) -> Setup:
    """All cylinders, from near by, to their longest or shortest stroke that range and cylinder allow."""
    ends, aside = np.array([stroke_range(scene, i, SAMPLES) for i in range(len(scene.joints))]), SHARE
    last, other = (ends[:, 1], ends[:, 0]) if longest else (ends[:, 0], ends[:, 1])
    first = last + aside * (other - last)
    move = Motion("to the ends", joint_angles_of_strokes(scene, first), first, last - first, 1.0, 2.0)
    return Setup(scene, move, move.angles, 2.0, 1e-3, 1.0)


def _stroke_for(scene: Scene, posture: str, turn: float) -> float:
    """Travel (m) of cylinder 1 that turns joint 1 by `turn` (rad) from a posture."""
    angle = motion_of(scene, posture).angles[0]
    first, last = stroke_curve(scene, 0, np.array([angle, angle + turn]))
    return float(last - first)
