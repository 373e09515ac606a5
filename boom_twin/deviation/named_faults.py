"""Deviation of the tip by faults that are named, which neither prediction nor estimate contain."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from ..compiler.compile import compile_scene
from ..errors import SolverError, UsageError
from ..scene.schema import Scene
from ..types import Array, StrokeReading
from .posture import Posture
from .rest_at_readings import RestFinder


class FaultyBoom(NamedTuple):
    """Boom with one fault: its scene, and the standard deviation of the fault's size over that size."""

    scene: Scene
    spread: float


class NamedFaults:
    """Named faults of a boom, and how they move its tip at rest.

    At rest in the posture, what drives the model reads r, and the tip is at x_0. Where that reads r, the boom with fault j has
    its tip at x_j. The size s_j of the fault is known with the standard deviation e_j s_j. So the mean square of the motion is

        sum_j (1 + e_j^2) (x_j - x_0) (x_j - x_0)^T.
    """

    def __init__(self, posture: Posture, reads: StrokeReading) -> None:
        self._posture, self._reads = posture, reads
        self._faults: Sequence[FaultyBoom] = ()
        self._finders: list[RestFinder] = []
        self._drives: Array = posture.drives.copy()

    def write_covariance(self, faults: Sequence[FaultyBoom], out: Array) -> None:
        """Write the upper triangle (6,) of the covariance of x, y, angle of the tip, if faults or posture are new."""
        p, n = self._posture, len(self._drives)
        if faults is not self._faults:
            self._faults = faults
            self._finders = [RestFinder(each.scene, compile_scene(each.scene), p, self._reads) for each in faults]
        elif not faults or np.array_equal(p.drives, self._drives):
            return
        self._drives, out[:] = p.drives.copy(), 0.0
        readings = p.read[:n] + p.tilt if p.reads_angle else p.drives + p.oil_read * p.pulled
        for fault, finder in zip(faults, self._finders, strict=True):
            with suppress(UsageError, SolverError):  # no equilibrium there
                moved = finder.tip_at(readings) - p.read[n : n + 3]
                out += (1.0 + fault.spread**2) * np.outer(moved, moved)[np.triu_indices(3)]
