"""Points of the finite-segment boom in motion: place, velocity, Jacobian, and acceleration at zero second derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..records import Array
from .tables import Places, Tables


@dataclass(frozen=True)
class Points:
    """p points. With coordinates q, the acceleration of a point is `jacobian` q'' + `bias`.

    Attributes
    ----------
    place, velocity, bias : ndarray, shape (p, 2)
    jacobian : ndarray, shape (p, 2, n)
    """

    place: Array
    velocity: Array
    jacobian: Array
    bias: Array

    def __getitem__(self, which: slice | Places) -> Points:
        return Points(*(values[which] for values in (self.place, self.velocity, self.jacobian, self.bias)))


@dataclass(frozen=True)
class Turns:
    """Headings (rad) of p frames: value, rate, Jacobian (p, n), and second rate at zero second derivatives."""

    value: Array
    rate: Array
    jacobian: Array
    bias: Array

    def __getitem__(self, which: slice | Places) -> Turns:
        return Turns(*(values[which] for values in (self.value, self.rate, self.jacobian, self.bias)))


def joined(*groups: Points) -> Points:
    """All points of some groups in one."""
    rows = [(group.place, group.velocity, group.jacobian, group.bias) for group in groups]
    return Points(*(np.concatenate(parts) for parts in zip(*rows, strict=True)))


def fixed(place: tuple[float, float], n: int) -> Points:
    """One point of the base."""
    return Points(np.array([place]), np.zeros((1, 2)), np.zeros((1, 2, n)), np.zeros((1, 2)))


def carried(origin: Points, turns: Turns, ahead: Array, aside: Array) -> Points:
    """Points at (`ahead`, `aside`), each (p,) in m, in frames that turn about the points `origin`."""
    c, s = np.cos(turns.value), np.sin(turns.value)
    arm = np.stack([ahead * c - aside * s, ahead * s + aside * c], axis=1)
    across = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    return Points(
        origin.place + arm,
        origin.velocity + across * turns.rate[:, None],
        origin.jacobian + across[:, :, None] * turns.jacobian[:, None, :],
        origin.bias + across * turns.bias[:, None] - arm * (turns.rate**2)[:, None],
    )


def chain_points(tables: Tables, base: tuple[float, float], q: Array, v: Array) -> tuple[Points, Turns]:
    """All points of `tables` and the headings of its links at coordinates q with rates v, each (n,)."""
    t = tables
    heading, omega, stretch, speed = t.turn @ q, t.turn @ v, t.stretch @ q, t.stretch @ v
    length = t.length + stretch
    along = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    sides = along[:, :, None] * t.stretch[:, None, :] + (across * length[:, None])[:, :, None] * t.turn[:, None, :]
    ends = Points(
        np.add(_summed(along * length[:, None]), base),
        _summed(along * speed[:, None] + across * (length * omega)[:, None]),
        _summed(sides),
        _summed(across * (2.0 * speed * omega)[:, None] - along * (length * omega**2)[:, None]),
    )
    k = t.link
    turns = Turns(heading, omega, t.turn, np.zeros(len(heading)))
    points = carried(ends[k], turns[k], t.ahead + t.share * stretch[k], t.aside)
    moving = t.share != 0.0
    k, share = k[moving], t.share[moving, None]
    points.velocity[moving] += share * along[k] * speed[k, None]
    points.jacobian[moving] += (share * along[k])[:, :, None] * t.stretch[k][:, None, :]
    points.bias[moving] += share * across[k] * (2.0 * speed * omega)[k, None]
    return points, turns


def _summed(steps: Array) -> Array:
    """Sums of all steps before each one, and nothing before the first; the last sum is left out."""
    sums = np.zeros_like(steps)
    np.cumsum(steps[:-1], axis=0, out=sums[1:])
    return sums


def spans(barrel: Points, rod: Points) -> tuple[Turns, Turns]:
    """Lengths (as values with rate, Jacobian and bias) and headings of the cylinders between their pins."""
    span, speed = rod.place - barrel.place, rod.velocity - barrel.velocity
    jacobian, bias = rod.jacobian - barrel.jacobian, rod.bias - barrel.bias
    length = np.hypot(span[:, 0], span[:, 1])
    along = span / length[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    rate, turning = np.sum(along * speed, axis=1), np.sum(across * speed, axis=1) / length
    lengths = Turns(
        length, rate, np.einsum("ij,ijk->ik", along, jacobian), np.sum(along * bias, axis=1) + length * turning**2
    )
    headings = Turns(
        np.arctan2(span[:, 1], span[:, 0]), turning, np.einsum("ij,ijk->ik", across, jacobian) / length[:, None],
        (np.sum(across * bias, axis=1) - 2.0 * rate * turning) / length,
    )  # fmt: skip
    return lengths, headings


def all_turns(*groups: Turns) -> Turns:
    """All headings of some groups in one."""
    rows = [(group.value, group.rate, group.jacobian, group.bias) for group in groups]
    return Turns(*(np.concatenate(parts) for parts in zip(*rows, strict=True)))
