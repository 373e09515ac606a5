"""Variants of a scene with parts left out, as edits that a user could make.

A kind of part (`VariantKind`) says which keys of one section, or of the joint that turns it, leave the part out. Payload
and line fill are loads, not parts of the model, and stay.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from ..scene.edit import Edit, edited
from ..scene.schema import Scene

MOST_MODES = 6  # bending coordinates per flexible part that are tried


@dataclass(frozen=True)
class Variant:
    """A scene without something. `name` in words, `kind` for grouping, and the edits that make it."""

    name: str
    kind: str
    edits: tuple[Edit, ...]

    def of(self, scene: Scene) -> Scene:
        """The scene after the edits."""
        return edited(scene, self.edits)


def _rigid(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _section(i, "modes", 0) if scene.is_flexible(i) else ()


def _axial(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _section(i, "axial", False) if scene.is_flexible(i) and scene.has_axial(i) else ()


def _geometric(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _section(i, "geometric", False) if scene.is_flexible(i) and scene.has_geometric(i) else ()


def _rotary(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _section(i, "rho_I", None) if scene.sections[i].rho_I else ()


def _beam_damping(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _section(i, "beta", None) if scene.is_flexible(i) and scene.sections[i].beta else ()


def _compliance(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _cylinder(scene, i, "k", "oil", "d") if scene.joints[i].cylinder.is_compressible else ()


def _oil_damping(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _cylinder(scene, i, "d") if scene.joints[i].cylinder.d else ()


def _links(scene: Scene, i: int) -> tuple[Edit, ...]:
    joint = scene.joints[i]
    return tuple(Edit(("joints", i, key), None) for key in ("mL", "mR") if getattr(joint, key))


def _barrel(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _cylinder(scene, i, "barrel")


def _rod(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _cylinder(scene, i, "rod")


def _section(i: int, key: str, value: bool | int | None) -> tuple[Edit, ...]:
    return (Edit(("sections", i, key), value),)


def _cylinder(scene: Scene, i: int, *keys: str) -> tuple[Edit, ...]:
    present = [key for key in keys if getattr(scene.joints[i].cylinder, key) is not None]
    return tuple(Edit(("joints", i, "cylinder", key), None) for key in present)


def _fewer_modes(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _section(i, "modes", scene.modes_of(i) - 1) if scene.is_flexible(i) else ()


@dataclass(frozen=True)
class VariantKind:
    """A kind of part. `edits` (scene, section or joint from 0) leaves it out there; none where there is none.

    `phrase` completes "section 2" or "cylinder 2" (`owner`); `singly` says whether a study looks at each one by itself.
    """

    name: str
    owner: str
    phrase: str
    edits: Callable[[Scene, int], tuple[Edit, ...]]
    singly: bool


KINDS = (
    VariantKind("bending", "section", "rigid", _rigid, True),
    VariantKind("axial coordinate", "section", "without axial coordinate", _axial, True),
    VariantKind("geometric stiffness", "section", "without geometric stiffness", _geometric, True),
    VariantKind("rotary inertia", "section", "without rotary inertia (rho_I)", _rotary, False),
    VariantKind("beam damping", "section", "without beam damping (beta)", _beam_damping, False),
    VariantKind("cylinder compliance", "cylinder", "incompressible", _compliance, True),
    VariantKind("cylinder damping", "cylinder", "without oil damping (d)", _oil_damping, False),
    VariantKind("link masses", "joint", "with massless links", _links, False),
    VariantKind("barrel masses", "cylinder", "with a massless barrel", _barrel, False),
    VariantKind("rod masses", "cylinder", "with a massless rod", _rod, False),
)
FEWER_MODES = VariantKind("modes", "section", "with one shape less", _fewer_modes, True)


def without(scene: Scene, kind: VariantKind, where: Sequence[int]) -> Variant | None:
    """The scene without a kind of part in the sections or joints `where` (from 0); None if there is none to leave out."""
    edits = tuple(edit for i in where for edit in kind.edits(scene, i))
    if not edits:
        return None
    return Variant(f"{_named(kind.owner, where, len(scene.sections))} {kind.phrase}", kind.name, edits)


def with_modes(scene: Scene, count: int, where: Sequence[int]) -> Variant | None:
    """The scene with `count` bending coordinates per flexible part of the sections `where`; None if that is no change."""
    changed = [i for i in where if scene.is_flexible(i) and scene.modes_of(i) != count]
    if not changed:
        return None
    name = f"{_named('section', where, len(scene.sections))} with modes: {count}"
    return Variant(name, "modes", tuple(edit for i in changed for edit in _section(i, "modes", count)))


def variants(scene: Scene) -> tuple[Variant, ...]:
    """All that a study of a scene's parts compares: everywhere at once first, then one by one where that is of use."""
    everywhere = range(len(scene.sections))
    wheres: list[Sequence[int]] = [everywhere, *([i] for i in everywhere if len(everywhere) > 1)]
    found = [without(scene, kind, where) for kind in KINDS for where in (wheres if kind.singly else wheres[:1])]
    found += [with_modes(scene, count, where) for where in wheres for count in range(1, MOST_MODES + 1)]
    if scene.clearance is not None and scene.clearance.pins:
        found.insert(0, Variant("all pins ideal", "clearance", (Edit(("clearance",), None),)))
    return tuple(_distinct(variant for variant in found if variant is not None))


def _distinct(found: Iterator[Variant]) -> Iterator[Variant]:
    """Yield variants, but none that edits what an earlier one edits: "all sections" where only one has the part."""
    seen = set()
    for variant in found:
        if variant.edits not in seen:
            seen.add(variant.edits)
            yield variant


def _named(owner: str, where: Sequence[int], count: int) -> str:
    """`section 2`, `sections 3 to 5` or `all sections`."""
    if len(where) == 1:
        return f"{owner} {where[0] + 1}"
    return f"all {owner}s" if len(where) == count else f"{owner}s {where[0] + 1} to {where[-1] + 1}"
