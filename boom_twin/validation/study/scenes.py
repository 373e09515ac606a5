"""Scenes for studies: a scene with one thing changed, and long booms of any number of sections made to one recipe.

Joint 1 of a long boom is of kind A, the others are six-bars, all geometrically similar to those of the default scene. Second
moments and oil stiffnesses follow the static moments of the boom stretched out horizontally, so that every boom bends and gives
by the same angles in all. Six-bars of short sections are low, so their cylinders push along the beams with forces that grow
with the number of sections: the made-up material gets stiffer to match. The numbers describe no real machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...kernels.elements.linkage import cylinder_length
from ...reduction import search
from ...scene.edit import scaled, with_rigid_cylinders
from ...scene.kinematics import linkage_of
from ...scene.schema import Base, Cylinder, Joint, Scene, Section, Tip
from ...scene.summary import mass_of
from ...types import Array


def with_modes(scene: Scene, count: int) -> Scene:
    """Return the scene with `count` bending coordinates in every flexible part; 0 makes all sections rigid."""
    variant = search.with_modes(scene, count, range(len(scene.sections)))
    return scene if variant is None else variant.of(scene)


def cylinders(scene: Scene, stiffness: float | None) -> Scene:
    """Return the scene with this oil stiffness (N/m) of all cylinders, damping in proportion; None: incompressible."""
    if stiffness is None:
        return with_rigid_cylinders(scene)

    def changed(cylinder: Cylinder) -> Cylinder:
        lag = (cylinder.d or 0.0) / cylinder.middle_stiffness if cylinder.is_compressible else 3e-3  # s
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
    calm = _with_sections(scene, lambda section: section.model_copy(update={"beta": None}))
    return _with_cylinders(calm, lambda cylinder: cylinder.model_copy(update={"d": None}))


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


DENSITY, GRAVITY = 7850.0, 9.81  # kg/m^3, m/s^2
BENT, GIVEN_WAY = 0.1, 0.05  # rad in all: of the beams, of the cylinders, stretched out under gravity
LIGHT, HEAVY = 40.0, 200.0  # kg/m at the tip, at the base
UNIT = 3.3  # m, length of the section whose six-bars are copied
REACH = 8.0  # deg that each joint can turn to either side of the posture
SIX_BARS: dict[str, dict[str, Any]] = {
    "B1": {"C": (-0.816, 0.18), "D": (-0.14, -0.04), "E": (0.12, 0.062), "lL": 0.42, "lR": 0.377},
    "B2": {"C": (-1.298, 0.18), "D": (-0.14, -0.04), "E": (0.12, 0.081), "lL": 0.42, "lR": 0.367, "R": (0.42, 0.12)},
    "B3": {"C": (-1.300, 0.18), "D": (-0.14, -0.04), "E": (0.12, 0.100), "lL": 0.42, "lR": 0.347, "R": (0.02, -0.12)},
}  # m, of the default scene


@dataclass(frozen=True)
class _Sizes:
    """Sizes of every section, shape (n,): length (m), mass per metre (kg/m), mass (kg), moment at its inboard pivot (N m).

    `modulus` is that of the material (Pa).
    """

    length: Array
    per_metre: Array
    mass: Array
    moment: Array
    modulus: float


def long_boom(count: int, kinds: Sequence[str] = ("B1",)) -> Scene:
    """Return a boom of `count` equal sections (2 or more), 20 m in all, with the posture ``test``: a gentle arch.

    `kinds` of joints 2, 3, .. are taken in turn.
    """
    return boom_of(np.full(count, 20.0 / count), kinds, np.linspace(50.0, 0.0, count))


def seven_sections() -> Scene:
    """Return a boom of 101 m in seven sections with all kinds of joints; the posture ``test`` is an arch."""
    lengths = np.array([20.0, 17.0, 15.0, 14.0, 13.0, 12.0, 10.0])
    return boom_of(lengths, ("B1", "B2", "B3"), np.array([75.0, 55.0, 35.0, 10.0, -15.0, -40.0, -60.0]))


def boom_of(lengths: Array, kinds: Sequence[str], headings: Array) -> Scene:
    """Return a boom of sections of `lengths` (m) at falling `headings` (deg, steps below 165), both of shape (n,)."""
    sizes, relative = _sizes(lengths), np.diff(headings, prepend=0.0)
    scale = np.append(lengths[0], np.minimum(lengths[1:], lengths[:-1])) / UNIT
    base = Base(pivot=(0.0, 0.0), cylinder_pin=(0.45 * scale[0], -1.25 * scale[0]))
    sections = [_section(sizes, i, scale[0]) for i in range(len(lengths))]
    names = ["A", *(kinds[i % len(kinds)] for i in range(len(lengths) - 1))]
    joints = [_joint(name, sizes, i, scale[i], relative[i], (base, sections[0])) for i, name in enumerate(names)]
    return Scene.model_validate(
        {
            "description": f"{len(lengths)} sections, {lengths.sum():.6g} m, made up for studies of the numerics",
            "gravity": (0.0, -GRAVITY),
            "material": {"name": "steel", "E": sizes.modulus, "rho": DENSITY},
            "base": base,
            "sections": sections,
            "joints": joints,
            "postures": {"test": tuple(float(heading) for heading in headings)},
        }
    )


def _sizes(lengths: Array) -> _Sizes:
    ends = np.cumsum(lengths)
    middles, total = ends - 0.5 * lengths, ends[-1]
    per_metre = LIGHT + (HEAVY - LIGHT) * (1.0 - middles / total) ** 2
    mass = 1.5 * per_metre * lengths  # beam, rigid ends, links and cylinder
    moment = np.array([GRAVITY * mass[i:] @ (middles[i:] - (ends[i] - lengths[i])) for i in range(len(lengths))])
    modulus = 2.06e11 * max(1.0, len(lengths) / 7.0) ** 2  # Pa, steel up to 7 sections
    return _Sizes(lengths, per_metre, mass, moment, modulus)


def _section(sizes: _Sizes, i: int, base_scale: float) -> Section:
    length, beam_mass = float(sizes.length[i]), float(sizes.per_metre[i] * sizes.length[i])
    root, head = (0.6 * base_scale if i == 0 else 0.08 * length), 0.08 * length
    second_moment = sizes.moment[i] * sizes.length.sum() / (BENT * sizes.modulus)
    end = {"mass": 0.09 * beam_mass, "inertia": 0.09 * beam_mass * (0.03 * length) ** 2}
    return Section.model_validate(
        {
            "length": length, "beam": (root, length - head), "A": sizes.per_metre[i] / DENSITY, "I": second_moment,
            "rho_A": sizes.per_metre[i], "rho_I": DENSITY * second_moment, "beta": 1e-3,
            "root": end | {"com": (0.5 * root, 0.0)}, "head": end | {"com": (length - 0.5 * head, 0.0)},
            "rod_pin": (root, -0.12 * base_scale) if i == 0 else None,
        }
    )  # fmt: skip


def _links(kind: str, scale: float, mass: float) -> dict[str, Any]:
    """Return links of a six-bar, those of the default scene times `scale`, for a section of `mass` (kg)."""

    def scaled(value: Any) -> Any:
        return tuple(scale * x for x in value) if isinstance(value, tuple) else scale * value

    return {key: scaled(value) for key, value in SIX_BARS[kind].items()} | {"mL": 0.02 * mass, "mR": 0.015 * mass}


def _joint(kind: str, sizes: _Sizes, i: int, scale: float, angle: float, ground: tuple[Base, Section]) -> Joint:
    """Return joint `i` that turns `REACH` degrees to either side of `angle` (deg); `ground` carries cylinder 1."""
    lever = 0.55 * scale if kind == "A" else 0.15 * scale  # m/rad
    stiffness = sizes.moment[i] * len(sizes.length) / (GIVEN_WAY * lever**2)
    low, high = angle - REACH, angle + REACH
    part = {"mass": 0.06 * sizes.mass[i], "inertia": 0.06 * sizes.mass[i] * (0.2 * scale) ** 2, "com": 0.25 * scale}
    cylinder = {"k": stiffness, "d": 3e-3 * stiffness, "closed_length": 1.0, "max_stroke": 1.0, "barrel": part, "rod": part}
    links = {} if kind == "A" else _links(kind, scale, sizes.mass[i])
    joint = Joint.model_validate({"kind": kind, "range_deg": (low, high), "cylinder": cylinder} | links)
    row = linkage_of(joint, *ground)
    lengths = [cylinder_length(row, math.radians(phi))[0] for phi in np.linspace(low, high, 101)]
    margin = 0.1 * (max(lengths) - min(lengths))
    travel = {"closed_length": min(lengths) - margin, "max_stroke": max(lengths) - min(lengths) + 2.0 * margin}
    return joint.model_copy(update={"cylinder": joint.cylinder.model_copy(update=travel)})
