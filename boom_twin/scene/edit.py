"""Change a scene: single parameters by name, keys as an editor would change them, the text with comments kept, another load.

``cylinder_i.k`` (N/m), ``cylinder_i.d`` (N s/m), ``section_i.EI`` (N m^2), ``section_i.beta`` (s), ``section_i.mass`` (kg, of
all its parts, without concrete), ``tip.payload`` (kg), ``line_fill`` (kg/m), ``base.inclination`` (rad), ``base.stiffness``
(N m/rad), ``base.damping`` (N m s/rad). k of a cylinder with `oil` is that at half its stroke; to change it changes the bulk
modulus, and with that k by the same factor over the whole stroke.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, TypeVar, cast

from pydantic import BaseModel
from ruamel.yaml.error import YAMLError

from ..config.yaml_text import Place, with_values, words, yaml_text
from ..errors import SceneError, UsageError
from .block_reader import validated
from .load import examine_text, parse, text_of
from .schema import Cylinder, CylinderPart, RigidPart, Scene, Section, Tip

Body = TypeVar("Body", RigidPart, CylinderPart)


def parameter_names(scene: Scene) -> tuple[str, ...]:
    """Return every parameter that `scene` has; payload, line fill and inclination always, for they may be nothing."""
    names = []
    for i, joint in enumerate(scene.joints):
        names += [f"cylinder_{i + 1}.k"] if joint.cylinder.is_compressible else []
        names += [f"cylinder_{i + 1}.d"] if joint.cylinder.d is not None else []
    for i, section in enumerate(scene.sections):
        names += [f"section_{i + 1}.EI"] if scene.is_flexible(i) else []
        names += [f"section_{i + 1}.beta"] if scene.is_flexible(i) and section.beta else []
        names += [f"section_{i + 1}.mass"] if section.mass > 0.0 else []
    elastic = [f"base.{key}" for key in ("stiffness", "damping") if getattr(scene.base, key) is not None]
    return (*names, *elastic, "tip.payload", "line_fill", "base.inclination")


def parameter(scene: Scene, name: str) -> float:
    """Return the value of one parameter, SI; UsageError if the scene has none of that name."""
    part, key = _owner(scene, name)
    if isinstance(part, Cylinder) and key == "k":
        return part.middle_stiffness
    if isinstance(part, Section) and key == "EI":
        return scene.material.E * (part.I or 0.0)
    return part.mass if isinstance(part, Section) and key == "mass" else float(getattr(part, key) or 0.0)


def with_parameters(scene: Scene, values: Mapping[str, float]) -> Scene:
    """Return the scene with other values of some parameters, SI; UsageError for a name or a value that it cannot have."""
    for name, value in values.items():
        scene = _with_one(scene, name, float(value))
    return scene


def with_rigid_cylinders(scene: Scene) -> Scene:
    """Return the scene without oil springs: each cylinder is a strut whose length is prescribed."""
    none = dict.fromkeys(("k", "oil", "d"))
    struts = [joint.model_copy(update={"cylinder": joint.cylinder.model_copy(update=none)}) for joint in scene.joints]
    return scene.model_copy(update={"joints": tuple(struts)})


def _with_one(scene: Scene, name: str, value: float) -> Scene:
    part, key = _owner(scene, name)
    is_positive = key in ("k", "EI", "mass", "stiffness")
    bound = "" if key == "inclination" else " and above 0" if is_positive else " and at least 0"
    if not math.isfinite(value) or (bound and not (value > 0.0 if is_positive else value >= 0.0)):
        raise UsageError(f"{name} = {value:g}: must be finite{bound}.")
    changes: dict[str, Any] = {key: value}
    if isinstance(part, Cylinder) and key == "k" and (oil := part.oil) is not None:
        modulus = oil.bulk_modulus * value / part.middle_stiffness
        changes = {"oil": oil.model_copy(update={"bulk_modulus": modulus})}
    elif isinstance(part, Section) and key == "EI":
        changes = {"I": value / scene.material.E}
    elif isinstance(part, Section) and key == "mass":
        factor = value / part.mass
        changes = {end: scaled(body, factor) for end in ("root", "head") if (body := getattr(part, end)) is not None}
        changes |= {each: factor * own for each in ("rho_A", "rho_I") if (own := getattr(part, each)) is not None}
    return cast(Scene, _with(scene, _place(name), part.model_copy(update=changes)))


def scaled(part: Body, factor: float) -> Body:
    """Return a part with `factor` times its mass and inertia."""
    return part.model_copy(update={"mass": factor * part.mass, "inertia": factor * part.inertia})


def _place(name: str) -> Place:
    owner, dot, _ = name.partition(".")
    kind, _, number = owner.partition("_")
    if kind == "cylinder":
        return ("joints", int(number) - 1, "cylinder")
    if kind == "section":
        return ("sections", int(number) - 1)
    return (owner,) if dot else ()


def _owner(scene: Scene, name: str) -> tuple[Any, str]:
    """Return the block that has a parameter, and the key. UsageError if the scene has no such parameter."""
    if name not in parameter_names(scene):
        raise UsageError(f"{name}: the scene has no such parameter. It has {', '.join(parameter_names(scene))}.")
    part: Any = scene
    for step in _place(name):
        part = part[step] if isinstance(step, int) else getattr(part, step)
    return Tip() if name == "tip.payload" and part is None else part, name.rpartition(".")[2]


Value = bool | int


@dataclass(frozen=True)
class Edit:
    """One key of a scene, its place as in messages about scenes, and what it becomes; None takes it out of the file."""

    place: Place
    value: Value | None

    def __str__(self) -> str:
        if self.value is None:
            return f"remove {words(self.place)}"
        return f"{words(self.place)}: {yaml_text(self.value)}"


def edited(scene: Scene, edits: Iterable[Edit]) -> Scene:
    """Return the scene that the file describes after all `edits`."""
    for edit in edits:
        scene = _with(scene, edit.place, edit.value)
    return scene


def merged(edits: Iterable[Edit]) -> tuple[Edit, ...]:
    """Return edits of the same result with only the last one of each key, in the order of the places."""
    last = {edit.place: edit for edit in edits}
    return tuple(last[place] for place in sorted(last, key=lambda place: [str(step) for step in place]))


def _with(part: Any, place: Sequence[str | int], value: Any) -> Any:
    """Return `part` (a block, a list, or a value if `place` is empty) with the value at `place` exchanged."""
    if not place:
        return value
    step, rest = place[0], place[1:]
    if isinstance(step, int):
        return tuple(_with(item, rest, value) if i == step else item for i, item in enumerate(part))
    assert isinstance(part, BaseModel)
    return part.model_copy(update={step: _with(getattr(part, step, None), rest, value)})


def rewritten(text: str, scene: Scene, wanted: Scene) -> str:
    """Return the text of `scene` with the values in which `wanted` differs, its comments kept.

    Blocks that share their text (YAML aliases) cannot be changed apart: then all of it is written anew, without comments.
    """
    try:
        text = with_values(text, _changes(scene.model_dump(), wanted.model_dump(), ()))
        found, faults = validated(parse(text, "changed scene"), Scene)
    except (YAMLError, SceneError):
        return anew(wanted)
    same = found is not None and not faults and _same(found.model_dump(), wanted.model_dump())
    return text if same else anew(wanted)


def differences(before: Scene, after: Scene) -> list[tuple[Place, Any]]:
    """Return the places of the values of the model that differ, and their values in `after`."""
    texts = {"description", "postures"}
    return [*_changes(before.model_dump(exclude=texts), after.model_dump(exclude=texts), ())]


def _changes(before: Any, after: Any, place: Place) -> Iterator[tuple[Place, Any]]:
    """Yield the places of the single values that differ, with their new ones."""
    if isinstance(after, dict):
        for key, value in after.items():
            yield from _changes(before.get(key) if isinstance(before, dict) else None, value, (*place, key))
    elif isinstance(after, tuple) and isinstance(before, tuple) and len(after) == len(before):
        for i, (one, other) in enumerate(zip(before, after, strict=True)):
            yield from _changes(one, other, (*place, i))
    elif after != before:
        yield place, after


def _same(one: Any, other: Any) -> bool:
    digits = 1e-5  # relative; values are written with six digits
    if isinstance(one, dict):
        return isinstance(other, dict) and one.keys() == other.keys() and all(_same(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return isinstance(other, tuple | list) and len(one) == len(other) and all(map(_same, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=digits)
    return bool(one == other)


def anew(scene: Scene) -> str:
    """Return a scene as a file without comments."""
    return text_of(scene.model_dump(mode="json", exclude_none=True))


def changed(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """Return the scene with other values, checked as a file is; see `Scene.with_`."""
    for name, value in changes.items():
        if name in ("payload", "tip.payload"):
            scene = cast(Scene, _with(scene, ("tip",), (scene.tip or Tip()).model_copy(update={"payload": value})))
        elif name in Scene.model_fields:
            scene = cast(Scene, _with(scene, (name,), value))
        elif "." in name:
            scene = with_parameters(scene, {name: value})
        else:
            known = ["payload", *Scene.model_fields, *parameter_names(scene)]
            near = get_close_matches(name, known, n=1, cutoff=0.0)[0]
            raise UsageError(f"{name}: a scene has no such key. The nearest is {near}.")
    with warnings.catch_warnings(action="ignore"):  # of pydantic, on values that `examine_text` then refuses
        text = anew(scene)
    return examine_text(text, "changed scene")[0]


def loaded(scene: Scene, payload: float, line_fill: float) -> Scene:
    """Return the scene with that payload (kg) and line fill (kg/m); below 0 its own."""
    loads = {"tip.payload": payload, "line_fill": line_fill}
    return with_parameters(scene, {name: value for name, value in loads.items() if value >= 0.0})
