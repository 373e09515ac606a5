"""Variants of a scene with parts left out, and the search for the leanest that keeps the tip near the full model's.

A kind of part (`VariantKind`) says which keys of one section, or of the joint that turns it, leave the part out. Payload and
line fill are loads, not parts of the model, and stay.

Parts are left out one after another, first what adds the least error for what it saves, and after each the error of all that
is left out together is measured anew; errors of single parts are never added up. What costs nothing (damping, compliance of
cylinders) stays. The search ends when no part that is left could go as well, so a second search finds nothing more.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from ..errors import SolverError, UsageError
from ..scene.edit import Edit, edited, merged
from ..scene.schema import Scene
from .deviation import Deviation, Response, StrokeCourse, answer, course_of, deviation, size, step_times, unknowns

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


def _beam(key: Literal["axial", "geometric"]) -> Edits:
    """Return edits that turn off a key of a flexible section."""
    return _section(key, False, lambda scene, i: scene.is_flexible(i) and scene.of_section(i, key))


def _cylinder(*keys: str) -> Edits:
    """Return edits that remove keys of a cylinder, those that are there."""
    return lambda scene, i: tuple(
        Edit(("joints", i, "cylinder", key), None) for key in keys if getattr(scene.joints[i].cylinder, key) is not None
    )


def _links(scene: Scene, i: int) -> tuple[Edit, ...]:
    return tuple(Edit(("joints", i, key), None) for key in ("mL", "mR") if getattr(scene.joints[i], key))


def _fewer_modes(scene: Scene, i: int) -> tuple[Edit, ...]:
    return (Edit(("sections", i, "modes"), scene.of_section(i, "modes") - 1),) if scene.is_flexible(i) else ()


_rotary = _section("rho_I", None, lambda scene, i: scene.sections[i].rho_I)
_damping = _section("beta", None, lambda scene, i: scene.is_flexible(i) and scene.sections[i].beta)


def _oil_damping(scene: Scene, i: int) -> tuple[Edit, ...]:
    return _cylinder("d")(scene, i) if scene.joints[i].cylinder.d else ()


KINDS = (
    VariantKind("bending", "section", "rigid", _section("modes", 0, Scene.is_flexible), True),
    VariantKind("axial coordinate", "section", "without axial coordinate", _beam("axial"), True),
    VariantKind("geometric stiffness", "section", "without geometric stiffness", _beam("geometric"), True),
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
    edits = tuple(
        Edit(("sections", i, "modes"), count) for i in where if scene.is_flexible(i) and scene.of_section(i, "modes") != count
    )
    return Variant(f"{_named('section', where, len(scene.sections))} with modes: {count}", "modes", edits) if edits else None


def variants(scene: Scene) -> tuple[Variant, ...]:
    """Return all that a study of parts compares: everywhere at once first, then one by one where that is of use.

    A variant that edits what an earlier one edits is left out: "all sections" where only one has the part.
    """
    everywhere = range(len(scene.sections))
    wheres: list[Sequence[int]] = [everywhere, *([i] for i in everywhere if len(everywhere) > 1)]
    found = [without(scene, kind, where) for kind in KINDS for where in (wheres if kind.singly else wheres[:1])]
    found += [with_modes(scene, count, where) for where in wheres for count in range(1, 7)]
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


GROUPS = 8  # sections are left out one by one up to so many; on a longer boom so many runs of neighbours

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Proposal:
    """Result of a search: the lean scene and its deviation."""

    scene: Scene  # the lean one
    edits: tuple[Edit, ...]  # from the full scene to the lean one
    deviation: Deviation  # of the lean model's tip from the full model's
    course: StrokeCourse  # on which the deviation was measured
    unknowns: tuple[int, int]  # of a step of the full and of the lean model
    seconds: tuple[float, float]  # a step of either takes, s; the least of interleaved runs of the move
    next: tuple[str, float] | None  # what would have to go next, and the error (m) that this would lead to


def propose(full: Scene, most: float, progress: Progress = lambda _: None) -> Proposal:
    """Look for the leanest model whose tip stays within `most` (m) of that of the scene `full`.

    `progress` is told in words what is done. UsageError if `most` is not positive, SolverError if the full model itself has no
    equilibrium or fails in the move.
    """
    if not (math.isfinite(most) and most > 0.0):
        raise UsageError(f"need = {most!r} m: must be positive. Give for example 0.001.")
    search = _Search(full, most, progress)
    while search.round():
        pass
    lean = search.model()
    found = search.measured(search.edits)
    progress("measuring run times")
    times = step_times((full, lean), search.course, 30)
    counts = (unknowns(full), unknowns(lean))
    return Proposal(lean, search.edits, found, search.course, counts, (float(times[0]), float(times[1])), search.next)


class _Search:
    """The present model, as edits of the full one, and all errors measured so far."""

    def __init__(self, full: Scene, most: float, progress: Progress) -> None:
        self.scene, self.most, self.progress = full, most, progress
        self.course = course_of(full)
        self.edits: tuple[Edit, ...] = ()
        self.full: Response = answer(full, self.course)
        if self.full.status != "ok":
            raise SolverError(f"the full model itself fails: {self.full.status}")
        self.known: dict[tuple[Edit, ...], Deviation] = {}
        self.size = cache(lambda edits: size(edited(full, edits)))  # of the full scene after `edits`, see `reduction.deviation`
        self.next: tuple[str, float] | None = None

    def model(self) -> Scene:
        """The present model."""
        return edited(self.scene, self.edits)

    def measured(self, edits: tuple[Edit, ...]) -> Deviation:
        """Return the deviation of the scene after `edits` from the full one."""
        if edits not in self.known:
            self.progress(f"{len(self.known)} models measured, {len(self.edits)} edits kept")
            found = answer(edited(self.scene, edits), self.course)
            self.known[edits] = deviation(found, self.full, self.course)
        return self.known[edits]

    def round(self) -> bool:
        """Try everything that is still there, the cheapest error first; return True if anything could go."""
        before, self.next = self.edits, None
        queue = [entry for number, part in enumerate(self._parts()) if (entry := self._priced(number, *part))]
        heapq.heapify(queue)
        while queue:
            _, number, kind, where = heapq.heappop(queue)
            trial = self._trial(kind, where)
            if trial is None:
                continue
            variant, edits = trial
            error = self.measured(edits).worst
            if error <= self.most:
                self.edits = edits
                if again := self._priced(number, kind, where):
                    heapq.heappush(queue, again)
            elif self.next is None or error < self.next[1]:
                self.next = (variant.name, error)
        return self.edits != before

    def _parts(self) -> Iterator[tuple[VariantKind, Sequence[int]]]:
        """Every kind of part, everywhere and in every group of sections."""
        everywhere = range(len(self.scene.sections))
        groups = [group.tolist() for group in np.array_split(everywhere, min(GROUPS, len(everywhere)))]
        for kind in (FEWER_MODES, *KINDS):
            for where in [everywhere, *groups] if len(groups) > 1 else [everywhere]:
                yield kind, where

    def _trial(self, kind: VariantKind, where: Sequence[int]) -> tuple[Variant, tuple[Edit, ...]] | None:
        """The present model without a part, and all its edits; None if the part is gone or costs nothing."""
        variant = without(self.model(), kind, where)
        if variant is None:
            return None
        edits = merged((*self.edits, *variant.edits))
        return (variant, edits) if self.size(edits) < self.size(self.edits) else None

    def _priced(
        self, number: int, kind: VariantKind, where: Sequence[int]
    ) -> tuple[float, int, VariantKind, Sequence[int]] | None:
        """Entry of the queue, error added per size saved first; None if there is nothing to leave out."""
        trial = self._trial(kind, where)
        if trial is None:
            return None
        added = self.measured(trial[1]).worst - self.measured(self.edits).worst
        return added / (self.size(self.edits) - self.size(trial[1])), number, kind, where
