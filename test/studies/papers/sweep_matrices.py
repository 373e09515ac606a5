"""Transfer matrices of substructures by the package's sweep, and the papers' boundary problem solved by their product."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from boom_twin import Scene
from boom_twin.analysis.drive import PASSES, STEP_TOLERANCE
from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.motions import motion_of
from boom_twin.compiler.compile import BasisName, compile_scene
from boom_twin.compiler.plan import Plan
from boom_twin.errors import SolverError
from boom_twin.kernels.integrators import GENERALISED_ALPHA, prepare
from boom_twin.kernels.tables import OK, Motion, State, Work
from boom_twin.kernels.transfer.matrix_product import SIX, new_product, open_end, transfer_matrix
from boom_twin.kernels.transfer.riccati_sweep import FREE, clear_cut, sweep_in
from boom_twin.kernels.transfer.time_step import ANEW, LONGEST_INCREMENT, advance

from .element_matrices import Step
from .substructures import Substructure, substructures

ORDER = np.array([0, 1, 2, 5, 3, 4])  # x, y, theta, M, qx, qy among x, y, theta, qx, qy, M
RHO = 0.8


def step_of_move(scene: Scene, span: float, length: float, basis: BasisName = "end-shapes") -> tuple[Plan, State, Work, Step]:
    """The boom after `span` s of the reference move in steps of `length` s, with what its last step consisted of."""
    plan, move = compile_scene(scene, basis), motion_of(scene)
    state, work = plan.state(), plan.work()
    settle(plan, state, work, move.first, move.angles)
    scheme = prepare(GENERALISED_ALPHA, RHO, length, work.weights)
    for k in range(1, round(span / length) + 1):
        strokes, rates = (values[0] for values in move(np.array([k * length])))
        drive = plan.closed_lengths + strokes
        status, _, _ = advance(
            plan.tables, state, work, scheme, drive, rates, STEP_TOLERANCE * 1e-3, PASSES, LONGEST_INCREMENT, None, ANEW
        )
        if status != OK:
            raise SolverError(f"the reference move fails at {k * length:g} s.")
    motion = Motion(scheme.gain, scheme.rate, work.hat.copy(), work.offset.copy())
    return plan, state, work, Step(plan.tables, motion, drive, rates)


def forces_at_cuts(plan: Plan, state: State, work: Work, step: Step) -> np.ndarray:
    """qx, qy (N) and M (N m) at every cut, shape (operations + 1, 3); they mean something where nothing is carried."""
    count = len(plan.tables.operations)
    found = np.zeros((count + 1, 3))
    for k in range(count):
        clear_cut(work, FREE)
        sweep_in(
            plan.tables, state, work, step.motion, step.drive, step.drive_rate, np.int64(max(k, 1)), np.int64(count), FREE,
            work.condensed,
        )  # fmt: skip
        found[k] = work.p[:3]
    return found


def chain_of(scene: Scene, span: float, length: float) -> tuple[list[Substructure], list[np.ndarray]]:
    """Substructures of a boom on its reference move, and the same matrices (7, 7) by the sweep."""
    plan, state, work, step = step_of_move(scene, span, length)
    forces = forces_at_cuts(plan, state, work, step)
    own = substructures([joint.kind for joint in scene.joints], plan, state, step, forces)
    return own, [swept(plan, state, work, step, forces, one) for one in own]


def swept(plan: Plan, state: State, work: Work, step: Step, forces: np.ndarray, one: Substructure) -> np.ndarray:
    """Transfer matrix (7, 7) of a substructure as the sweep condenses it, about the same vectors."""
    room, force = new_product(plan.tables), forces[one.last].copy()
    u = np.zeros((6, 7))
    open_end(work, force)
    _, _, m = sweep_in(
        plan.tables, state, work, step.motion, step.drive, step.drive_rate, np.int64(one.first), np.int64(one.last), SIX,
        work.condensed,
    )  # fmt: skip
    s, p = work.s[:m, :m].copy(), work.p[:m].copy()
    if m > SIX:  # the force of cylinder 1
        s, p = s[:6, :6] - np.outer(s[:6, 6], s[6, :6]) / s[6, 6], p[:6] - s[:6, 6] * p[6] / s[6, 6]
    transfer_matrix(s, p, force, room.a, room.right, room.order, u)
    # U maps (de_I, f_I, 1) to (de_O, f_O): give it back the places that it counts from
    linear, found = u[:, :6][np.ix_(ORDER, ORDER)], np.eye(7)
    inlet = np.append(one.inlet[:3], np.zeros(3))
    found[:6, :6] = linear
    found[:6, 6] = u[ORDER, 6] + np.append(one.outlet[:3], np.zeros(3)) - linear @ inlet
    return found


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Return the difference of two transfer matrices as a share of the larger, with displacements and forces scaled alike."""
    ratio = np.sqrt(np.abs(one[3:6, :3]).max() / np.abs(one[:3, 3:6]).max())
    scale = np.array([1.0, 1.0, 1.0, ratio, ratio, ratio, 1.0])
    a, b = (matrix / scale[:, None] * scale for matrix in (one, other))
    return float(np.abs(a - b).max() / np.abs(a).max())


def boundary_solution(chain: Sequence[Substructure]) -> np.ndarray:
    """Return the base vector (6,) by the product of all matrices; the base's place and the free tip are known."""
    product = np.eye(7)
    for one in chain:
        product = one.matrix @ product
    unknown, known = [2, 4, 5], [0, 1, 3]
    first = chain[0].inlet.copy()
    right = -(product[3:6, known] @ first[known] + product[3:6, 6])
    block = product[np.ix_([3, 4, 5], unknown)]
    scale = np.abs(block).max(axis=1, keepdims=True)
    first[unknown] = np.linalg.solve(block / scale, right / scale[:, 0])
    return first
