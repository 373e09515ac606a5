"""The finite-segment boom as arrays: links in a row, points on them, and how both hang on the coordinates.

The same cuts as in `segments`, but without derivatives by rule: links of the chain turn by constant sums of coordinates and
are straight, so positions are cumulative sums. Coordinates q: for every section the heading of its root, then a turn and a
stretch for every spring. The links of the six-bars are no coordinates here; their angles follow in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..records import Array
from ..scene.parts import Scene
from .pieces import half_segment, pieces, pins, rigid_masses, spring_stiffness

Places = NDArray[np.int64]


@dataclass(frozen=True)
class Tables:
    """k links, p points on them, n coordinates, s sections.

    Attributes
    ----------
    turn, stretch : ndarray, shape (k, n)
        Derivatives of the headings (rad) and lengths (m) of the links by the coordinates; constant.
    length : ndarray, shape (k,)
        m, unstretched.
    link : ndarray of int, shape (p,)
        The link that carries a point.
    ahead, aside, share : ndarray, shape (p,)
        Place of a point on its link: `ahead` + `share` times its stretch, and `aside` of it (m).
    mass, inertia : ndarray, shape (m,)
        kg, kg m^2, of the first m points.
    stiffness, damping : ndarray, shape (n,)
        Of the springs; 0 for headings.
    root, head : ndarray of int, shape (s,)
        First and last link of every section.
    rod_pin : int
        Point at which the rod of cylinder 1 is pinned.
    barrel_pin, d, e : ndarray of int, shape (s - 1,)
        Points C, D and E of every six-bar.
    tip : int
        The tip's point.
    """

    turn: Array
    stretch: Array
    length: Array
    link: Places
    ahead: Array
    aside: Array
    share: Array
    mass: Array
    inertia: Array
    stiffness: Array
    damping: Array
    root: Places
    head: Places
    rod_pin: int
    barrel_pin: Places
    d: Places
    e: Places
    tip: int


@dataclass
class _Draft:
    """What has been laid down so far; rows of `links` are (length, turning coordinates, stretching coordinate)."""

    links: list[tuple[float, tuple[int, ...], int | None]] = field(default_factory=list)
    masses: list[tuple[int, float, float, float, float, float]] = field(default_factory=list)
    springs: list[tuple[float, float]] = field(default_factory=list)  # stiffness, damping, one per coordinate
    ends: list[tuple[int, int]] = field(default_factory=list)
    pins: list[dict[str, tuple[int, float, float]]] = field(default_factory=list)


def tables_of(scene: Scene, fineness: int) -> Tables:
    """Lay a scene down with about 4 `fineness` springs in every flexible section."""
    draft = _Draft()
    for index in range(len(scene.sections)):
        _section(draft, scene, index, fineness)
    last = draft.ends[-1][1]
    if scene.tip is not None and scene.tip.payload:
        draft.masses.append((last, draft.links[last][0], 0.0, 0.0, scene.tip.payload, 0.0))
    return _finish(scene, draft)


def _section(draft: _Draft, scene: Scene, index: int, fineness: int) -> None:
    first = len(draft.links)
    turning: tuple[int, ...] = (len(draft.springs),)
    draft.springs.append((0.0, 0.0))
    draft.pins.append({})
    parts = pieces(scene, index, fineness)
    for k, part in enumerate(parts):
        here, last = len(draft.links), k == len(parts) - 1
        for name, (p, aside) in pins(scene, index).items():
            reached = (p < part.x1 - 1e-9 or last) and (p <= part.x0 + 1e-9 or part.springs == 0)
            if name not in draft.pins[-1] and reached:
                draft.pins[-1][name] = (here, p - part.x0, aside)
        if part.springs:
            turning = _beam(draft, scene, index, (part.x1 - part.x0) / part.springs, part.springs, turning)
            continue
        for body in rigid_masses(scene, index, part.x0, part.x1):
            draft.masses.append((here, body.com[0] - part.x0, body.com[1], 0.0, body.mass, body.inertia))
        draft.links.append((part.x1 - part.x0, turning, None))
    draft.ends.append((first, len(draft.links) - 1))


def _beam(
    draft: _Draft, scene: Scene, index: int, h: float, springs: int, turning: tuple[int, ...]
) -> tuple[int, ...]:
    """Half a segment, a spring, half a segment; returns the coordinates that turn what follows."""
    beta, (mass, inertia) = scene.sections[index].beta or 0.0, half_segment(scene, index, h)
    for _ in range(springs):
        stretching = len(draft.springs) + 1
        for stiffness in spring_stiffness(scene, index, h):
            draft.springs.append((stiffness, beta * stiffness))
        for after in (False, True):
            turning = (*turning, stretching - 1) if after else turning
            draft.masses.append((len(draft.links), 0.25 * h, 0.0, 0.5, mass, inertia))
            draft.links.append((0.5 * h, turning, stretching))
    return turning


def _finish(scene: Scene, draft: _Draft) -> Tables:
    n, count = len(draft.springs), len(draft.links)
    turn, stretch = np.zeros((count, n)), np.zeros((count, n))
    for k, (_, turning, stretching) in enumerate(draft.links):
        turn[k, list(turning)] = 1.0
        if stretching is not None:
            stretch[k, stretching] = 0.5
    root, head = np.array(draft.ends).T
    last = draft.ends[-1][1]
    points = [mass[:4] for mass in draft.masses]
    points += [(last, draft.links[last][0], 0.0, 0.0), (*draft.pins[0]["rod"], 0.0)]
    for index, joint in enumerate(scene.joints[1:]):
        assert joint.D is not None and joint.E is not None
        end = draft.links[head[index]][0]
        points += [(*draft.pins[index]["C"], 0.0), (int(head[index]), end + joint.D[0], joint.D[1], 0.0)]
        points.append((int(root[index + 1]), joint.E[0], joint.E[1], 0.0))
    link, ahead, aside, share = np.array(points).T
    first = len(draft.masses) + 2
    barrel_pin, d, e = (np.arange(first + i, len(points), 3) for i in range(3))
    stiffness, damping = np.array(draft.springs).T
    mass, inertia = np.array([mass[4:] for mass in draft.masses]).reshape(-1, 2).T
    return Tables(
        turn, stretch, np.array([row[0] for row in draft.links]), link.astype(np.int64), ahead, aside, share,
        mass, inertia, stiffness, damping, root, head,
        first - 1, barrel_pin, d, e, first - 2,
    )  # fmt: skip
