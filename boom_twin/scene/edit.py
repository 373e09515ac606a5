"""Single parameters of a boom by the names that alarms, calibration and reports use.

``cylinder_i.k`` (N/m), ``cylinder_i.d`` (N s/m), ``section_i.EI`` (N m^2), ``section_i.beta`` (s), ``section_i.mass`` (kg, of
all its parts, without concrete), ``tip.payload`` (kg), ``line_fill`` (kg/m).
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from ..errors import UsageError
from .parts import Cylinder, RigidPart, Scene, Section, Tip

_NAME = re.compile(r"(cylinder|section)_([1-9]\d*)\.(k|d|EI|beta|mass)")


def parameter_names(scene: Scene) -> tuple[str, ...]:
    """Every parameter that `scene` has; payload and line fill always, for they may be nothing."""
    names = []
    for i, joint in enumerate(scene.joints):
        names += [f"cylinder_{i + 1}.{key}" for key in ("k", "d") if getattr(joint.cylinder, key) is not None]
    for i, section in enumerate(scene.sections):
        names += [f"section_{i + 1}.EI"] if scene.is_flexible(i) else []
        names += [f"section_{i + 1}.beta"] if scene.is_flexible(i) and section.beta else []
        names += [f"section_{i + 1}.mass"] if section_mass(section) > 0.0 else []
    return (*names, "tip.payload", "line_fill")


def parameter(scene: Scene, name: str) -> float:
    """Value of one parameter, SI.

    Raises
    ------
    UsageError
        The scene has no parameter of that name.
    """
    owner, index, key = _parsed(scene, name)
    if owner == "tip":
        return 0.0 if scene.tip is None or scene.tip.payload is None else scene.tip.payload
    if owner == "line_fill":
        return scene.line_fill or 0.0
    if owner == "cylinder":
        return float(getattr(scene.joints[index].cylinder, key))
    section = scene.sections[index]
    if key == "EI":
        assert section.I is not None
        return scene.material.E * section.I
    return section_mass(section) if key == "mass" else float(section.beta or 0.0)


def with_parameters(scene: Scene, values: Mapping[str, float]) -> Scene:
    """The scene with other values of some parameters, SI; what is not named stays.

    Raises
    ------
    UsageError
        The scene has no parameter of that name, or the value is not one that a scene may have.
    """
    for name, value in values.items():
        scene = _with_one(scene, name, float(value))
    return scene


def section_mass(section: Section) -> float:
    """Mass (kg) of root, beam and head."""
    beam = 0.0 if section.beam is None or section.rho_A is None else section.rho_A * (section.beam[1] - section.beam[0])
    return beam + sum(part.mass for part in (section.root, section.head) if part is not None)


def _with_one(scene: Scene, name: str, value: float) -> Scene:
    owner, index, key = _parsed(scene, name)
    least_is_open = key in ("k", "EI", "mass")
    if not (value > 0.0 if least_is_open else value >= 0.0) or value == float("inf"):
        raise UsageError(f"{name} = {value:g}: must be finite and {'above 0' if least_is_open else 'at least 0'}.")
    if owner == "tip":
        return scene.model_copy(update={"tip": (scene.tip or Tip()).model_copy(update={"payload": value})})
    if owner == "line_fill":
        return scene.model_copy(update={"line_fill": value})
    if owner == "cylinder":
        joints = list(scene.joints)
        cylinder: Cylinder = joints[index].cylinder.model_copy(update={key: value})
        joints[index] = joints[index].model_copy(update={"cylinder": cylinder})
        return scene.model_copy(update={"joints": tuple(joints)})
    sections = list(scene.sections)
    sections[index] = _section(scene, sections[index], key, value)
    return scene.model_copy(update={"sections": tuple(sections)})


def _section(scene: Scene, section: Section, key: str, value: float) -> Section:
    if key == "EI":
        return section.model_copy(update={"I": value / scene.material.E})
    if key == "beta":
        return section.model_copy(update={"beta": value})
    factor = value / section_mass(section)
    changes: dict[str, object] = {
        name: _heavier(part, factor) for name in ("root", "head") if (part := getattr(section, name)) is not None
    }
    if section.rho_A is not None:
        changes["rho_A"] = factor * section.rho_A
    if section.rho_I is not None:
        changes["rho_I"] = factor * section.rho_I
    return section.model_copy(update=changes)


def _heavier(part: RigidPart, factor: float) -> RigidPart:
    return part.model_copy(update={"mass": factor * part.mass, "inertia": factor * part.inertia})


def _parsed(scene: Scene, name: str) -> tuple[str, int, str]:
    """Owner, 0-based index and key of a name."""
    if name == "tip.payload":
        return "tip", 0, "payload"
    if name == "line_fill":
        return "line_fill", 0, "line_fill"
    found = _NAME.fullmatch(name)
    if found is None or name not in parameter_names(scene):
        known = ", ".join(parameter_names(scene))
        raise UsageError(f"{name}: the scene has no such parameter. It has {known}.")
    return found[1], int(found[2]) - 1, found[3]
