"""A compiled boom, and the arrays that a step of it works on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..chain.program import SLOTS, State, Tables, Work
from ..physics import contact
from ..physics.integrators import DEPTH, new_weights
from ..records import Array

LOOP = 11 + 8 + SLOTS - 3  # most rows of the system of a six-bar: see `chain.substructure_b`


@dataclass(frozen=True)
class Plan:
    """A compiled boom.

    Attributes
    ----------
    tables : Tables
        What the kernels read.
    names : tuple of str
        The unknowns, in order.
    masses, weights : ndarray, shape (histories,)
        Inertia of every history (kg, kg m^2; 0 for those of unknowns) and weight along it (N).
    outline : ndarray of int, shape (k, 2)
        Points of the centre line, base to tip: (0, row of frames) or (1, place of x among the histories).
    closed_lengths : ndarray, shape (n,)
        Of the cylinders, m.
    pins : tuple of str
        Pins with clearance, in the order of `tables.clearances`.
    """

    tables: Tables
    names: tuple[str, ...]
    masses: Array
    weights: Array
    outline: np.ndarray
    closed_lengths: Array
    pins: tuple[str, ...] = ()

    @property
    def joints(self) -> int:
        """Number of joints, and of sections."""
        return len(self.tables.joints)

    def state(self, depth: int = DEPTH) -> State:
        """A fresh state, all zero; `depth` rows of history."""
        histories, n = len(self.masses), self.joints
        return State(
            z=np.zeros(len(self.names)), history=np.zeros((depth, histories)),
            frames=np.zeros((len(self.tables.operations) + 1, 5)), turns=np.zeros((n, 8)), pins=np.zeros((n, 4)),
            contacts=np.zeros((len(self.pins), contact.COLUMNS)), drives=np.zeros((2, n)), pace=np.zeros(1, np.int64),
        )  # fmt: skip

    def work(self, depth: int = DEPTH) -> Work:
        """Scratch arrays of the right sizes, for schemes of `depth`."""
        t, histories = self.tables, len(self.masses)
        points, shapes = max(t.psi.shape[1], 1), t.psi.shape[2] + 1
        beams, operations, n, pins = len(t.beams), len(t.operations), self.joints, len(self.pins)
        inner = 6 + 2 * max((int(joint.clearances) for joint in t.joints), default=0)
        return Work(
            position=np.zeros(histories), hat=np.zeros(histories), offset=np.zeros(histories), weights=new_weights(depth),
            finer=new_weights(depth), s=np.zeros((SLOTS, SLOTS)), p=np.zeros(SLOTS), g=np.zeros(LOOP), h=np.zeros((LOOP, LOOP)),
            own_g=np.zeros(5), own_h=np.zeros((5, 5)), matrix=np.zeros((inner, inner)), right=np.zeros((inner, SLOTS)),
            gains=np.zeros((operations, max(inner, shapes), SLOTS)), free=np.zeros((operations, max(inner, shapes))),
            block=np.zeros((shapes, shapes)), blocks=np.tile(np.eye(inner), (n, 1, 1)), ends=np.tile(np.eye(2), (pins, 1, 1)),
            end_gains=np.zeros((pins, 2, 5)), end_free=np.zeros((pins, 2)), hold=np.zeros((pins, 9)),
            apart=np.zeros((2, LOOP + 1)), rho=np.zeros((beams, points, 2)), drho=np.zeros((beams, points, shapes, 2)),
            angles=np.zeros(points), turn=np.zeros((beams, points, 4)), local=np.zeros((points, 2)), drive=np.zeros(n),
            drive_rate=np.zeros(n), dz=np.zeros(len(self.names)), cut=np.zeros(SLOTS),
        )  # fmt: skip
