"""What play in the pin of one rod does to the resting tip, from wide clearances down to the switch to the ideal pin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.rows import first_row, taken_apart
from ..analysis.statics import settle
from ..peers.play import geometry
from ..plan.compile import compile_scene
from ..records import Array
from ..scene.kinematics import posture_angles, strokes_of_posture
from ..scene.parts import IDEAL_BELOW, Scene
from .clearance_scenes import ideal, pin_like, treated, with_pins

WIDEST = 1e-3  # m
NUDGE = 1e-4  # m
COUNT, QUICK_COUNT = 13, 3


@dataclass(frozen=True)
class Shift:
    """Tip at rest with play in one rod's pin against ideal pins. k clearances, falling to `IDEAL_BELOW`.

    Attributes
    ----------
    clearances, shifts, penetrations : ndarray, shape (k,)
        m; distance of the tips; how far the journal presses into the bush.
    force : float
        Of the pin at the last clearance, N.
    lever, loaded : float
        The tip's way for the cylinder's: of the rigid boom's geometry, and of the loaded elastic boom with ideal pins.
    """

    posture: str
    pin: str
    clearances: Array
    shifts: Array
    penetrations: Array
    force: float
    lever: float
    loaded: float

    @property
    def jump(self) -> float:
        """Of the tip at the switch to the ideal pin, m."""
        return float(self.shifts[-1])

    @property
    def ratios(self) -> Array:
        """Shifts over loaded lever x (clearance + penetration), shape (k,)."""
        return np.asarray(self.shifts / (self.loaded * (self.clearances + self.penetrations)))


def shifts(scene: Scene, postures: tuple[str, ...], count: int = COUNT) -> list[Shift]:
    """Every cylinder in every posture."""
    document, contact = scene.model_dump(exclude_none=True), treated(scene, "contact")
    found = []
    for posture in postures:
        tip, joints = _rest(ideal(scene), posture)[:2]
        levers = np.abs(geometry.levers(document, np.cumsum(joints)))
        for i, lever in enumerate(levers.tolist()):
            found.append(_shift(contact, posture, i, (lever, _loaded(ideal(scene), posture, i)), tip, count))
    return found


def _shift(scene: Scene, posture: str, index: int, levers: tuple[float, float], tip: Array, count: int) -> Shift:
    clearances = np.geomspace(WIDEST, IDEAL_BELOW, count)
    clearances[-1] = IDEAL_BELOW
    name = f"cylinder_{index + 1}.rod"
    rests = [_rest(with_pins(scene, [pin_like(scene, name, float(c))]), posture) for c in clearances]
    pins = np.array([pin[0] for _, _, pin in rests])
    return Shift(
        posture, name, clearances, np.array([np.hypot(*(own - tip)) for own, _, _ in rests]),
        np.hypot(pins[:, 0], pins[:, 1]) - clearances, float(pins[-1, 2]), *levers,
    )  # fmt: skip


def _loaded(scene: Scene, posture: str, index: int) -> float:
    """Way of the resting tip per metre of stroke `index`, by central differences."""
    ways = [_rest(scene, posture, side * NUDGE * np.eye(len(scene.joints))[index])[0] for side in (-1.0, 1.0)]
    return float(np.hypot(*(ways[1] - ways[0])) / (2.0 * NUDGE))


def _rest(scene: Scene, posture: str, more: float | Array = 0.0) -> tuple[Array, Array, Array]:
    """Tip (2,) in m, joint angles (n,) in rad, pins (k, 4) as in `analysis.rows`."""
    plan = compile_scene(scene)
    state = plan.state()
    settle(plan, state, plan.work(), strokes_of_posture(scene, posture) + more, posture_angles(scene, posture))
    row = taken_apart(plan, first_row(plan, state)[None])
    return row.tip[0, 0, :2], row.joints[0], row.pins[0]
