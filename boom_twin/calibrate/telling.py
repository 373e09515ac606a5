"""Which unknowns the sessions tell apart, and which posture would tell the others."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import BoomTwinError
from ..records import Array
from ..scene.kinematics import strokes_of_posture
from .fit import Fit
from .problem import Problem

TOGETHER = 0.7  # correlation from which on two unknowns count as one group
MORE = 10.0  # s of a hold in another posture
HELPS = 0.5  # of the deviation left, from which on a posture is worth the way


@dataclass(frozen=True)
class Group:
    """Unknowns that the sessions cannot tell apart, or do not show.

    Attributes
    ----------
    names : tuple of str
        One alone: the sessions do not show it.
    posture : str or None
        A posture of the scene in which a hold would tell them apart.
    enough : bool
        Whether it would do so fully.
    """

    names: tuple[str, ...]
    posture: str | None = None
    enough: bool = False

    def __str__(self) -> str:
        what = f"{self.names[0]}: these sessions do not show it" if len(self.names) == 1 else (
            f"{', '.join(self.names)}: these sessions cannot tell them apart"
        )  # fmt: skip
        if self.posture is None:
            return f"{what}; none of the scene's postures would. Left as before."
        verb = "would" if self.enough else "would help to"
        return f"{what}; a hold of {MORE:g} s in posture {self.posture} {verb}. Left as before."


def groups_of(problem: Problem, fit: Fit) -> list[Group]:
    """Unknowns whose estimates are too uncertain to be of use, together with those that they are confused with."""
    covariance = fit.covariance()
    spread = np.sqrt(np.diag(covariance))
    vague = spread > _useful(problem)
    tied = np.abs(covariance) > TOGETHER * np.outer(spread, spread)
    groups, left = [], set(np.flatnonzero(vague).tolist())
    while left:
        group: set[int] = set()
        grown = {min(left)}
        while grown != group:
            group, grown = grown, grown | set(np.flatnonzero(tied[sorted(grown)].any(axis=0) & vague).tolist())
        left -= group
        groups.append(_with_posture(problem, fit, sorted(group)))
    return groups


def _useful(problem: Problem) -> Array:
    """Deviations from which estimates are of use, in units of the priors'."""
    return np.array([unknown.kind.useful / unknown.kind.prior for unknown in problem.unknowns])


def _with_posture(problem: Problem, fit: Fit, group: list[int]) -> Group:
    """The group with the posture that leaves least of its uncertainty."""
    names, useful = tuple(problem.unknowns[i].name for i in group), _useful(problem)

    def left(more: Array | float) -> float:
        return float(np.max((np.sqrt(np.diag(fit.covariance(more))) / useful)[group]))

    found = {posture: left(more) for posture, more in _in_postures(problem, fit).items()}
    best = min(found, key=lambda posture: found[posture], default=None)
    if best is None or found[best] > max(1.0, HELPS * left(0.0)):
        return Group(names)
    return Group(names, best, found[best] <= 1.0)


def _in_postures(problem: Problem, fit: Fit) -> dict[str, Array]:
    """Information (p, p) that a hold in each of the scene's postures would add; those out of reach are left out."""
    found = {}
    for posture in problem.scene.postures or {}:
        try:
            _, slopes = problem.resting(fit.deviations, strokes_of_posture(problem.scene, posture)[None])
        except BoomTwinError:
            continue
        white = fit.whitening.of_constant(slopes[:, 0])
        found[posture] = MORE / problem.length * white @ white.T
    return found
