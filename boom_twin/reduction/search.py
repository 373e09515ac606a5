"""Search for the leanest model that keeps the tip within a stated distance of the full model's.

Parts are left out one after another, first what adds the least error for what it saves, and after each the error of all that
is left out together is measured anew; errors of single parts are never added up. What costs nothing (damping, compliance of
cylinders) stays. The search ends when no part that is left could go as well, so a second search finds nothing more.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import SolverError, UsageError
from ..scene.edit import Edit, edited, merged
from ..scene.schema import Scene
from .deviation import Deviation, Response, StrokeCourse, answer, course_of, deviation, size, step_times, unknowns
from .variants import FEWER_MODES, KINDS, Variant, VariantKind, without

GROUPS = 8  # sections are left out one by one up to so many; on a longer boom so many runs of neighbours
TIMED_RUNS = 30

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Proposal:
    """Result of a search: the lean scene and its deviation."""

    scene: Scene  # the lean one
    edits: tuple[Edit, ...]  # from the scene that the search started from to the lean one
    deviation: Deviation  # of the lean model's tip from the full model's
    course: StrokeCourse  # on which the deviation was measured
    unknowns: tuple[int, int]  # of a step of the full and of the lean model
    seconds: tuple[float, float]  # a step of either takes, s; the least of interleaved runs of the move
    next: tuple[str, float] | None  # what would have to go next, and the error (m) that this would lead to


def propose(full: Scene, most: float, start: Scene | None = None, progress: Progress = lambda _: None) -> Proposal:
    """Look for the leanest model whose tip stays within `most` (m) of that of the scene `full`.

    The search begins with `start`, a model of the same boom, by default `full` itself; `progress` is told in words what is
    done. UsageError if `most` is not positive, or `start` is another boom or further off already. SolverError if the full
    model itself has no equilibrium or fails in the move.
    """
    if not (math.isfinite(most) and most > 0.0):
        raise UsageError(f"need = {most!r} m: must be positive. Give for example 0.001.")
    search = _Search(full, start or full, most, progress)
    while search.round():
        pass
    lean = search.model()
    found = search.measured(search.edits)
    progress("measuring run times")
    times = step_times((full, lean), search.course, TIMED_RUNS)
    counts = (unknowns(full), unknowns(lean))
    return Proposal(lean, search.edits, found, search.course, counts, (float(times[0]), float(times[1])), search.next)


class _Search:
    """The present model, as edits of the one that the search started from, and all errors measured so far."""

    def __init__(self, full: Scene, start: Scene, most: float, progress: Progress) -> None:
        one, other = ([section.length for section in scene.sections] for scene in (full, start))
        if one != other:
            raise UsageError(f"lengths of sections = {other}: the full scene has {one}. Give two scenes of the same boom.")
        self.start, self.most, self.progress = start, most, progress
        self.course = course_of(full)
        self.edits: tuple[Edit, ...] = ()
        self.full: Response = answer(full, self.course)
        if self.full.status != "ok":
            raise SolverError(f"the full model itself fails: {self.full.status}")
        self.known: dict[tuple[Edit, ...], Deviation] = {}
        self.sizes: dict[tuple[Edit, ...], float] = {}
        self.next: tuple[str, float] | None = None
        first = self.measured(()).worst
        if first > most:
            off = f"the scene to start from is {first:.3g} m off already"
            raise UsageError(f"need = {most:g} m: {off}. Start from a fuller one.")

    def model(self) -> Scene:
        """The present model."""
        return edited(self.start, self.edits)

    def size(self, edits: tuple[Edit, ...]) -> float:
        """Return the size of the first model after `edits`, see `reduction.deviation`."""
        if edits not in self.sizes:
            self.sizes[edits] = size(edited(self.start, edits))
        return self.sizes[edits]

    def measured(self, edits: tuple[Edit, ...]) -> Deviation:
        """Return the deviation of the first model after `edits` from the full model."""
        if edits not in self.known:
            self.progress(f"{len(self.known)} models measured, {len(self.edits)} edits kept")
            found = answer(edited(self.start, edits), self.course)
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
        everywhere = range(len(self.start.sections))
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
