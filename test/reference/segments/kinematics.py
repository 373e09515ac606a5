"""Kinematics of the finite-segment reference boom: points, velocities, Jacobians.

The same cuts as in `segments`, but without derivatives by rule: links of the chain turn by constant sums of coordinates and
are straight, so positions are cumulative sums. Coordinates q: for every section the heading of its root, then a turn and a
stretch for every spring. The links of the six-bars are no coordinates here; their angles follow in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from boom_twin import Scene

from .geometry import half_segment, pieces, pins, rigid_masses, spring_stiffness

Places = NDArray[np.int64]


@dataclass(frozen=True)
class SegmentTables:
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
        Quantities C, D and E of every six-bar.
    tip : int
        The tip's point.
    """

    turn: np.ndarray
    stretch: np.ndarray
    length: np.ndarray
    link: Places
    ahead: np.ndarray
    aside: np.ndarray
    share: np.ndarray
    mass: np.ndarray
    inertia: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    root: Places
    head: Places
    rod_pin: int
    barrel_pin: Places
    d: Places
    e: Places
    tip: int


@dataclass
class _Draft:
    """Chain under construction; rows of `links` are (length, turning coordinates, stretching coordinate)."""

    links: list[tuple[float, tuple[int, ...], int | None]] = field(default_factory=list)
    masses: list[tuple[int, float, float, float, float, float]] = field(default_factory=list)
    springs: list[tuple[float, float]] = field(default_factory=list)  # stiffness, damping, one per coordinate
    ends: list[tuple[int, int]] = field(default_factory=list)
    pins: list[dict[str, tuple[int, float, float]]] = field(default_factory=list)


def segment_tables(scene: Scene, fineness: int) -> SegmentTables:
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


def _beam(draft: _Draft, scene: Scene, index: int, h: float, springs: int, turning: tuple[int, ...]) -> tuple[int, ...]:
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


def _finish(scene: Scene, draft: _Draft) -> SegmentTables:
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
    return SegmentTables(
        turn, stretch, np.array([row[0] for row in draft.links]), link.astype(np.int64), ahead, aside, share,
        mass, inertia, stiffness, damping, root, head,
        first - 1, barrel_pin, d, e, first - 2,
    )  # fmt: skip


@dataclass(frozen=True)
class Quantities:
    """p functions of the coordinates q: headings (rad) or lengths (m), or points (m), which have a second axis of size 2.

    Attributes
    ----------
    value, rate, bias : ndarray, shape (p,) or (p, 2)
        The second rate is `jacobian` q'' + `bias`.
    jacobian : ndarray, shape (p, n) or (p, 2, n)
    """

    value: np.ndarray
    rate: np.ndarray
    jacobian: np.ndarray
    bias: np.ndarray

    def __getitem__(self, which: slice | Places) -> Quantities:
        return Quantities(*(values[which] for values in (self.value, self.rate, self.jacobian, self.bias)))


def joined(*groups: Quantities) -> Quantities:
    """All of some groups in one."""
    rows = [(group.value, group.rate, group.jacobian, group.bias) for group in groups]
    return Quantities(*(np.concatenate(parts) for parts in zip(*rows, strict=True)))


def fixed(place: tuple[float, float], n: int) -> Quantities:
    """One point of the base."""
    return Quantities(np.array([place]), np.zeros((1, 2)), np.zeros((1, 2, n)), np.zeros((1, 2)))


def carried(origin: Quantities, turns: Quantities, ahead: np.ndarray, aside: np.ndarray) -> Quantities:
    """Points at (`ahead`, `aside`), each (p,) in m, in frames that turn about the points `origin`."""
    c, s = np.cos(turns.value), np.sin(turns.value)
    arm = np.stack([ahead * c - aside * s, ahead * s + aside * c], axis=1)
    across = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    return Quantities(
        origin.value + arm,
        origin.rate + across * turns.rate[:, None],
        origin.jacobian + across[:, :, None] * turns.jacobian[:, None, :],
        origin.bias + across * turns.bias[:, None] - arm * (turns.rate**2)[:, None],
    )


def chain_points(
    tables: SegmentTables, base: tuple[float, float], q: np.ndarray, v: np.ndarray
) -> tuple[Quantities, Quantities]:
    """All points of `tables` and the headings of its links at coordinates q with rates v, each (n,)."""
    t = tables
    heading, omega, stretch, speed = t.turn @ q, t.turn @ v, t.stretch @ q, t.stretch @ v
    length = t.length + stretch
    along = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    sides = along[:, :, None] * t.stretch[:, None, :] + (across * length[:, None])[:, :, None] * t.turn[:, None, :]
    ends = Quantities(
        np.add(_summed(along * length[:, None]), base),
        _summed(along * speed[:, None] + across * (length * omega)[:, None]),
        _summed(sides),
        _summed(across * (2.0 * speed * omega)[:, None] - along * (length * omega**2)[:, None]),
    )
    k = t.link
    turns = Quantities(heading, omega, t.turn, np.zeros(len(heading)))
    points = carried(ends[k], turns[k], t.ahead + t.share * stretch[k], t.aside)
    moving = t.share != 0.0
    k, share = k[moving], t.share[moving, None]
    points.rate[moving] += share * along[k] * speed[k, None]
    points.jacobian[moving] += (share * along[k])[:, :, None] * t.stretch[k][:, None, :]
    points.bias[moving] += share * across[k] * (2.0 * speed * omega)[k, None]
    return points, turns


def _summed(steps: np.ndarray) -> np.ndarray:
    """Sums of all steps before each one, and nothing before the first; the last sum is left out."""
    sums = np.zeros_like(steps)
    np.cumsum(steps[:-1], axis=0, out=sums[1:])
    return sums


def spans(barrel: Quantities, rod: Quantities) -> tuple[Quantities, Quantities]:
    """Lengths and headings of the cylinders between their pins."""
    span, speed = rod.value - barrel.value, rod.rate - barrel.rate
    jacobian, bias = rod.jacobian - barrel.jacobian, rod.bias - barrel.bias
    length = np.hypot(span[:, 0], span[:, 1])
    along = span / length[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    rate, turning = np.sum(along * speed, axis=1), np.sum(across * speed, axis=1) / length
    lengths = Quantities(
        length, rate, np.einsum("ij,ijk->ik", along, jacobian), np.sum(along * bias, axis=1) + length * turning**2
    )
    headings = Quantities(
        np.arctan2(span[:, 1], span[:, 0]), turning, np.einsum("ij,ijk->ik", across, jacobian) / length[:, None],
        (np.sum(across * bias, axis=1) - 2.0 * rate * turning) / length,
    )  # fmt: skip
    return lengths, headings
