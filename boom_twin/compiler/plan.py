"""The compiled boom: tables of records built row by row, the arrays that a step works on, and the rows that kernels write."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..kernels.elements import pin_contact as contact
from ..kernels.elements.beam import TURN_ROWS
from ..kernels.elements.beam_equations import LOCAL_ROWS
from ..kernels.elements.cylinder import compliance_and_lag
from ..kernels.integrators import DEPTH, new_weights
from ..kernels.result_row import Results, results_of, row_width
from ..kernels.tables import CORRECTIONS, RECORDS, SLOTS, Condensed, State, Tables, Work
from ..kernels.transfer.time_step import observe
from ..types import Array


@dataclass
class Layout:
    """Rows so far, names of the unknowns, and of every history of a mass point its inertia and its weight.

    Inertia in kg or kg m^2, weight in N along x or y. Histories of the unknowns come first, so places of histories shift by
    their number in `table`.
    """

    rows: dict[str, list[dict[str, Any]]] = field(default_factory=lambda: {name: [] for name in RECORDS})
    names: list[str] = field(default_factory=list)
    masses: list[float] = field(default_factory=list)
    weights: list[float] = field(default_factory=list)

    def add(self, table: str, **values: Any) -> int:
        self.rows[table].append(values)
        return len(self.rows[table]) - 1

    def operate(self, kind: int, row: int) -> None:
        self.add("operations", kind=kind, row=row)

    def unknowns(self, names: list[str]) -> int:
        """Reserve unknowns of these names; return the place of the first."""
        self.names.extend(names)
        return len(self.names) - len(names)

    def histories(self, masses: list[float], weights: list[float]) -> int:
        """Reserve histories of mass points; return the place of the first, counted from behind the unknowns."""
        self.masses.extend(masses)
        self.weights.extend(weights)
        return len(self.masses) - len(masses)

    def table(self, name: str) -> np.recarray:
        rows = np.zeros(len(self.rows[name]), RECORDS[name])
        for i, values in enumerate(self.rows[name]):
            for key, value in values.items():
                rows[key][i] = value + len(self.names) if key in ("history", "turn") else value
        return rows.view(np.recarray)


LOOP = 11 + 8 + SLOTS - 3  # most rows of the system of a six-bar: see `kernels.transfer.six_bar`


@dataclass(frozen=True)
class Plan:
    """A compiled boom."""

    tables: Tables  # what the kernels read
    names: tuple[str, ...]  # the unknowns, in order
    masses: Array  # (histories,), inertia, kg, kg m^2; 0 for those of unknowns
    weights: Array  # (histories,), weight along each, N
    outline: np.ndarray  # (k, 2), centre line, base to tip: (0, row of frames) or (1, place of x among the histories)
    closed_lengths: Array  # (n,), of the cylinders, m
    pins: tuple[str, ...] = ()  # pins with clearance, in the order of `tables.clearances`

    @property
    def joints(self) -> int:
        """Number of joints, and of sections."""
        return len(self.tables.joints)

    @property
    def row_width(self) -> int:
        """Numbers of a row of results, see `boom_twin.kernels.result_row`."""
        return int(row_width(self.joints, len(self.pins)))

    def results(self, rows: Array) -> Results:
        """Return rows as the kernels wrote them, shape (.., row_width), by name."""
        return results_of(rows, self.joints, len(self.pins))

    def observed(self, state: State) -> Results:
        """Return the results of the instant in `state`."""
        row = np.zeros(self.row_width)
        observe(self.tables, state, row)
        return self.results(row)

    def compliances_and_lags(self, drives: Array) -> tuple[Array, Array]:
        """Return 1/k (m/N; 0 if incompressible) and d/k (s) of cylinders whose `drives` are so long (m); all of shape (n,)."""
        cylinders, oils = self.tables.cylinders, self.tables.oils
        compliances, lags = cylinders.compliance.copy(), cylinders.lag.copy()
        for i in np.flatnonzero(cylinders.oil >= 0):
            compliances[i], lags[i] = compliance_and_lag(cylinders[i], oils, drives[i])
        return compliances, lags

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
        rows = max(inner, shapes)
        condensed = Condensed(
            gains=np.zeros((operations, rows, SLOTS)), free=np.zeros((operations, rows)),
            factors=np.zeros((operations, rows, rows)), order=np.zeros((operations, rows), np.int64),
            blocks=np.tile(np.eye(inner), (n, 1, 1)), ends=np.tile(np.eye(2), (pins, 1, 1)),
            end_gains=np.zeros((pins, 2, 5)), end_free=np.zeros((pins, 2)),
        )  # fmt: skip
        return Work(
            position=np.zeros(histories), velocity=np.zeros(histories), acceleration=np.zeros(histories),
            hat=np.zeros(histories), offset=np.zeros(histories), weights=new_weights(depth),
            finer=new_weights(depth), s=np.zeros((SLOTS, SLOTS)), p=np.zeros(SLOTS), g=np.zeros(LOOP), h=np.zeros((LOOP, LOOP)),
            own_g=np.zeros(5), own_h=np.zeros((5, 5)), right=np.zeros((inner, SLOTS)),
            condensed=condensed, hold=np.zeros((pins, contact.HOLD_COLUMNS)),
            apart=np.zeros((2, LOOP + 1)), rho=np.zeros((beams, points, 2)), drho=np.zeros((beams, points, shapes, 2)),
            turn=np.zeros((beams, TURN_ROWS, points)), local=np.zeros((LOCAL_ROWS, points)), drive=np.zeros(n),
            drive_rate=np.zeros(n), load=np.zeros((2, 2)), dz=np.zeros(len(self.names)), guess=np.zeros(len(self.names)),
            corrections=np.zeros((CORRECTIONS, len(self.names))), kept_z=np.zeros(len(self.names)), kept=np.zeros(4),
            cut=np.zeros(SLOTS),
        )  # fmt: skip
