"""Scenes made extreme: one property of a boom multiplied, replaced or taken away."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..scene.explain import explain
from ..scene.parts import Cylinder, Joint, Scene, Section, Tip

STEEL_LAG = 3e-3  # s, damping over stiffness of a cylinder that names no stiffness


def cylinders(scene: Scene, stiffness: float | None) -> Scene:
    """All cylinders with this oil stiffness (N/m) and damping in proportion; None: incompressible."""

    def changed(cylinder: Cylinder) -> Cylinder:
        if stiffness is None:
            return cylinder.model_copy(update={"k": None, "d": None})
        lag = STEEL_LAG if cylinder.k is None else (cylinder.d or 0.0) / cylinder.k
        return cylinder.model_copy(update={"k": stiffness, "d": lag * stiffness})

    return _joints(scene, lambda joint: joint.model_copy(update={"cylinder": changed(joint.cylinder)}))


def bending(scene: Scene, factor: float) -> Scene:
    """All sections with `factor` times their second moment of area."""
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
        update: dict[str, Any] = {}
        for key in keys:
            part = getattr(joint.cylinder, key)
            if part is not None:
                lighter = {"mass": factor * part.mass, "inertia": factor * part.inertia}
                update[key] = part.model_copy(update=lighter)
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
    """No damping in beams or cylinders."""
    calm = _sections(scene, lambda s: s.model_copy(update={"beta": None}))
    return _joints(calm, lambda j: j.model_copy(update={"cylinder": j.cylinder.model_copy(update={"d": None})}))


def lighter_gravity(scene: Scene, share: float) -> Scene:
    """`share` of the scene's gravity."""
    return scene.model_copy(update={"gravity": (share * scene.gravity[0], share * scene.gravity[1])})


def posed(scene: Scene, headings: tuple[float, ...]) -> Scene:
    """With a posture ``case`` at section angles `headings` (deg)."""
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
