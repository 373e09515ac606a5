"""Six-bars in closed form: the angles of their links over the joint angle, with two derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..records import Array
from ..scene.parts import Joint


@dataclass(frozen=True)
class Angles:
    """Heading of a link against the head before, and its derivatives by the joint angle; each of shape (joints,)."""

    value: Array
    first: Array
    second: Array


class Linkages:
    """All six-bars of a boom, kinds B1 to B3."""

    def __init__(self, joints: Sequence[Joint]) -> None:
        self.d = np.array([complex(*joint.D) for joint in joints if joint.D])
        self.e = np.array([complex(*joint.E) for joint in joints if joint.E])
        self.left = np.array([joint.lL for joint in joints], dtype=float)
        self.right = np.array([joint.lR for joint in joints], dtype=float)

    def angles(self, phi: Array) -> tuple[Angles, Angles]:
        """Links L (from D) and R (from E) at joint angles `phi` (rad), shape (joints,); Q lies left of D->E.

        The diagonal D->E has length r and heading a; by the law of cosines L is turned from it by an angle that depends on
        r alone, and R from its reverse likewise.
        """
        turned = self.e * np.exp(1j * phi)
        gap, rate = turned - self.d, 1j * turned
        square = np.abs(gap) ** 2
        inner, bend = np.conj(gap) * rate, -np.conj(gap) * turned
        u1, u2 = 2.0 * inner.real, 2.0 * (np.abs(rate) ** 2 + bend.real)
        r = np.sqrt(square)
        r1 = u1 / (2.0 * r)
        span = Angles(r, r1, u2 / (2.0 * r) - r1**2 / r)
        a = Angles(np.angle(gap), inner.imag / square, bend.imag / square - inner.imag * u1 / square**2)
        left, right = _opening(span, self.left, self.right), _opening(span, self.right, self.left)
        return (
            Angles(a.value + left.value, a.first + left.first, a.second + left.second),
            Angles(a.value + np.pi - right.value, a.first - right.first, a.second - right.second),
        )


def _opening(span: Angles, own: Array, other: Array) -> Angles:
    """Angle between the diagonal and the link of length `own` (m), over the joint angle."""
    r, excess = span.value, own**2 - other**2
    cosine = (r + excess / r) / (2.0 * own)
    by_r, by_rr = (1.0 - excess / r**2) / (2.0 * own), excess / (own * r**3)
    sine = np.sqrt(1.0 - cosine**2)
    slope = -by_r / sine
    curvature = -(by_rr + cosine * slope**2) / sine
    return Angles(np.arccos(cosine), slope * span.first, curvature * span.first**2 + slope * span.second)
