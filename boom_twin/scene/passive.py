"""The joints of a boom's URDF that nothing drives: how links and cylinders are turned, by rigid geometry.

A URDF is a tree, a six-bar is not. Its links and cylinders hang in the tree by one pin each, and the positions of these
pins close the loops.
"""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np

from ..physics.linkage import LINK_L, LINKAGE, link_angles
from ..physics.rotation import turned
from ..records import Array
from .kinematics import linkage
from .parts import Scene

CYLINDER, LEFT, RIGHT = "cylinder_{}_swivel", "link_l_{}_swivel", "link_r_{}_swivel"


class PassiveJoints:
    """Positions of the passive joints of one scene.

    Attributes
    ----------
    names : tuple of str
        ``cylinder_1_swivel``, then of every six-bar i ``cylinder_i_swivel``, ``link_l_i_swivel``, ``link_r_i_swivel``.
    """

    def __init__(self, scene: Scene) -> None:
        self._rows = [(joint.kind == "A", _plain(linkage(scene, i))) for i, joint in enumerate(scene.joints)]
        kinds = [(CYLINDER,) if joint.kind == "A" else (CYLINDER, LEFT, RIGHT) for joint in scene.joints]
        self.names = tuple(name.format(i) for i, own in enumerate(kinds, start=1) for name in own)

    def positions(self, angles: Array) -> list[float]:
        """Angles (rad, from -pi to pi) in the order of `names`, at relative joint `angles` (rad), shape (n,).

        A barrel and link L are measured in the section before (the base for joint 1), link R in its own section. NaN where
        the links do not close.
        """
        positions: list[float] = []
        with np.errstate(invalid="ignore"):
            for (direct, row), phi in zip(self._rows, angles.tolist(), strict=True):
                positions += [_swivel_a(row, phi)] if direct else _swivels_b(row, phi)
        return positions


def _plain(row: np.record) -> SimpleNamespace:
    """The fields of a record as Python numbers, which cost a tenth to read."""
    return SimpleNamespace(**{name: row[name].item() for name in LINKAGE.names or ()})


def _swivel_a(row: SimpleNamespace, phi: float) -> float:
    x, y = turned(phi, row.ex, row.ey)
    return math.atan2(y - row.cy, x - row.cx)


def _swivels_b(row: SimpleNamespace, phi: float) -> list[float]:
    left, right = link_angles(row, phi)
    if row.mount == LINK_L:
        (x, y), turn = (row.dx, row.dy), left
    else:
        (x, y), turn = turned(phi, row.ex, row.ey), right
    dx, dy = turned(turn, row.along, row.left)
    barrel = math.atan2(y + dy - row.cy, x + dx - row.cx)
    return [barrel, float(left), math.remainder(right - phi, math.tau)]
