"""Variants of a scene with parts left out, as edits that a user could make.

A kind of part (`VariantKind`) says which keys of one section, or of the joint that turns it, leave the part out. Payload
and line fill are loads, not parts of the model, and stay.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..scene.edit import Edit, edited
from ..scene.schema import Scene

MOST_MODES = 6  # bending coordinates per flexible part that are tried
Edits = Callable[[Scene, int], tuple[Edit, ...]]


@dataclass(frozen=True)
class Variant:
    """A scene without something. `name` in words, `kind` for grouping, and the edits that make it."""

    name: str
    kind: str
    edits: tuple[Edit, ...]

    def of(self, scene: Scene) -> Scene:
        """Return the scene after the edits."""
        return edited(scene, self.edits)


@dataclass(frozen=True)
class VariantKind:
    """A kind of part. `edits` (scene, section or joint from 0) leaves it out there; none where there is none.

    `phrase` completes "section 2" or "cylinder 2" (`owner`); `singly` says whether a study looks at each one by itself.
    """

    name: str
    owner: str
    phrase: str
    edits: Edits
    singly: bool


def _section(key: str, value: bool | int | None, is_there: Callable[[Scene, int], object]) -> Edits:
    """Return edits that set a key of a section where the part is there."""
    return lambda scene, i: (Edit(("sections", i, key), value),) if is_there(scene, i) else ()


def _beam(key: str, is_there: Callable[[Scene, int], object]) -> Edits:
    """Return edits that turn off a key of a flexible section."""
    return _section(key, False, lambda scene, i: scene.is_flexible(i) and is_there(scene, i))


def _cylinder(*keys: str) -> Edits:
    """Return edits that remove keys of a cylinder, those that are there."""
    return lambda scene, i: tuple(
        Edit(("joints", i, "cylinder", key), None) for key in keys if getattr(scene.joints[i].cylinder, key) is not None
    )


def _links(scene: Scene, i: int) -> tuple[Edit, ...]:
    return tuple(Edit(("joints", i, key), None) for key in ("mL", "mR") if getattr(scene.joints[i], key))


def _fewer_modes(scene: Scene, i: int) -> tuple[Edit, ...]:
    return (Edit(("sections", i, "modes"), scene.modes_of(i) - 1),) if scene.is_flexible(i) else ()


_rotary = _section("rho_I", None, lambda scene, i: scene.sections[i].rho_I)
_damping = _section("beta", None, lambda scene, i: scene.is_flexible(i) and scene.sections[i].beta)


def _oil_damping(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _cylinder("d")(scene, i) if scene.joints[i].cylinder.d else ()


KINDS = (
    VariantKind("bending", "section", "rigid", _section("modes", 0, Scene.is_flexible), True),
    VariantKind("axial coordinate", "section", "without axial coordinate", _beam("axial", Scene.has_axial), True),
    VariantKind("geometric stiffness", "section", "without geometric stiffness", _beam("geometric", Scene.has_geometric), True),
    VariantKind("rotary inertia", "section", "without rotary inertia (rho_I)", _rotary, False),
    VariantKind("beam damping", "section", "without beam damping (beta)", _damping, False),
    VariantKind("cylinder compliance", "cylinder", "incompressible", _cylinder("k", "oil", "d"), True),
    VariantKind("cylinder damping", "cylinder", "without oil damping (d)", _oil_damping, False),
    VariantKind("link masses", "joint", "with massless links", _links, False),
    VariantKind("barrel masses", "cylinder", "with a massless barrel", _cylinder("barrel"), False),
    VariantKind("rod masses", "cylinder", "with a massless rod", _cylinder("rod"), False),
)
FEWER_MODES = VariantKind("modes", "section", "with one shape less", _fewer_modes, True)


def without(scene: Scene, kind: VariantKind, where: Sequence[int]) -> Variant | None:
    """Return the scene without a kind of part in the sections or joints `where` (from 0); None if there is none there."""
    edits = tuple(edit for i in where for edit in kind.edits(scene, i))
    return Variant(f"{_named(kind.owner, where, len(scene.sections))} {kind.phrase}", kind.name, edits) if edits else None


def with_modes(scene: Scene, count: int, where: Sequence[int]) -> Variant | None:
    """Return the scene with `count` bending coordinates a flexible part in sections `where`; None if that is no change."""
    edits = tuple(Edit(("sections", i, "modes"), count) for i in where if scene.is_flexible(i) and scene.modes_of(i) != count)
    return Variant(f"{_named('section', where, len(scene.sections))} with modes: {count}", "modes", edits) if edits else None


def variants(scene: Scene) -> tuple[Variant, ...]:
    """Return all that a study of parts compares: everywhere at once first, then one by one where that is of use.

    A variant that edits what an earlier one edits is left out: "all sections" where only one has the part.
    """
    everywhere = range(len(scene.sections))
    wheres: list[Sequence[int]] = [everywhere, *([i] for i in everywhere if len(everywhere) > 1)]
    found = [without(scene, kind, where) for kind in KINDS for where in (wheres if kind.singly else wheres[:1])]
    found += [with_modes(scene, count, where) for where in wheres for count in range(1, MOST_MODES + 1)]
    if scene.clearance is not None and scene.clearance.pins:
        found.insert(0, Variant("all pins ideal", "clearance", (Edit(("clearance",), None),)))
    if scene.base.stiffness is not None:
        edits = tuple(Edit(("base", key), None) for key in ("stiffness", "damping") if getattr(scene.base, key) is not None)
        found.append(Variant("base rigid", "base compliance", edits))
    distinct: dict[tuple[Edit, ...], Variant] = {}
    for variant in found:
        if variant is not None:
            distinct.setdefault(variant.edits, variant)
    return tuple(distinct.values())


def _named(owner: str, where: Sequence[int], count: int) -> str:
    """Return `section 2`, `sections 3 to 5` or `all sections`."""
    if len(where) == 1:
        return f"{owner} {where[0] + 1}"
    return f"all {owner}s" if len(where) == count else f"{owner}s {where[0] + 1} to {where[-1] + 1}"
