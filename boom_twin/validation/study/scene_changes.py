"""Scenes with one thing changed, for studies: modes, stiffness, masses, damping, load, posture."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...reduction import variants
from ...scene.edit import scaled, with_rigid_cylinders
from ...scene.oil_spring import middle_stiffness
from ...scene.schema import Cylinder, Joint, Scene, Section, Tip
from ...scene.summary import mass_of

STEEL_LAG = 3e-3  # s, damping over stiffness of a cylinder that names no stiffness


def with_modes(scene: Scene, count: int) -> Scene:
    """Return the scene with `count` bending coordinates in every flexible part; 0 makes all sections rigid."""
    variant = variants.with_modes(scene, count, range(len(scene.sections)))
    return scene if variant is None else variant.of(scene)


def cylinders(scene: Scene, stiffness: float | None) -> Scene:
    """Return the scene with this oil stiffness (N/m) of all cylinders, damping in proportion; None: incompressible."""
    if stiffness is None:
        return with_rigid_cylinders(scene)

    def changed(cylinder: Cylinder) -> Cylinder:
        lag = (cylinder.d or 0.0) / middle_stiffness(cylinder) if cylinder.is_compressible else STEEL_LAG
        return cylinder.model_copy(update={"k": stiffness, "oil": None, "d": lag * stiffness})

    return _with_cylinders(scene, changed)


def bending(scene: Scene, factor: float) -> Scene:
    """Return the scene with `factor` times the second moment of area of all sections."""
    return _with_sections(scene, lambda s: s if s.I is None else s.model_copy(update={"I": factor * s.I}))


def links(scene: Scene, factor: float) -> Scene:
    """Return the scene with `factor` times the masses of its links."""

    def changed(joint: Joint) -> Joint:
        masses = {key: getattr(joint, key) for key in ("mL", "mR")}
        return joint.model_copy(update={key: factor * mass for key, mass in masses.items() if mass is not None})

    return _with_joints(scene, changed)


def cylinder_parts(scene: Scene, keys: tuple[str, ...], factor: float) -> Scene:
    """Return the scene with `factor` times mass and inertia of its barrels, rods or both (`keys`)."""

    def changed(cylinder: Cylinder) -> Cylinder:
        parts = {key: getattr(cylinder, key) for key in keys}
        return cylinder.model_copy(update={key: scaled(part, factor) for key, part in parts.items() if part is not None})

    return _with_cylinders(scene, changed)


def loaded(scene: Scene, share: float) -> Scene:
    """Return the scene with a payload of `share` times the boom's mass."""
    mass = mass_of(scene.model_copy(update={"tip": None}))
    return scene.model_copy(update={"tip": Tip(payload=share * mass)})


def undamped(scene: Scene) -> Scene:
    """Return the scene without damping in beams and cylinders."""
    calm = _with_sections(scene, lambda section: section.model_copy(update={"beta": None}))
    return _with_cylinders(calm, lambda cylinder: cylinder.model_copy(update={"d": None}))


def lighter_gravity(scene: Scene, share: float) -> Scene:
    """Return the scene with `share` of its gravity."""
    return scene.model_copy(update={"gravity": (share * scene.gravity[0], share * scene.gravity[1])})


def posed(scene: Scene, headings: tuple[float, ...]) -> Scene:
    """Return the scene with a posture ``case`` at section angles `headings` (deg)."""
    return scene.model_copy(update={"postures": {"case": headings}})


def freed(scene: Scene, index: int, low: float, travel: float, relative: float) -> Scene:
    """Return the scene whose joint `index` may turn down to `low` (deg) with a cylinder of `travel` (m).

    In the posture ``case`` that joint stands at `relative` (deg), the others as in the posture ``arch``.
    """
    joint = scene.joints[index]
    cylinder = joint.cylinder.model_copy(update={"max_stroke": travel})
    wide = joint.model_copy(update={"range_deg": (low, joint.range_deg[1]), "cylinder": cylinder})
    turned = np.diff(scene.postures["arch"], prepend=0.0)
    turned[index] = relative
    joints = tuple(wide if i == index else other for i, other in enumerate(scene.joints))
    return posed(scene.model_copy(update={"joints": joints}), tuple(float(angle) for angle in np.cumsum(turned)))


def _with_sections(scene: Scene, change: Callable[[Section], Section]) -> Scene:
    return scene.model_copy(update={"sections": tuple(change(section) for section in scene.sections)})


def _with_joints(scene: Scene, change: Callable[[Joint], Joint]) -> Scene:
    return scene.model_copy(update={"joints": tuple(change(joint) for joint in scene.joints)})


def _with_cylinders(scene: Scene, change: Callable[[Cylinder], Cylinder]) -> Scene:
    return _with_joints(scene, lambda joint: joint.model_copy(update={"cylinder": change(joint.cylinder)}))
