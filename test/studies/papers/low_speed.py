"""Motion without Coriolis and centrifugal accelerations: the second paper's low-speed form, and what leaving them out costs.

Mass points then accelerate by J q'' instead of (J q')': with q'' = A (q - q_hat) the place from which a point's acceleration
is counted is x_hat = x - J (q - q_hat), found from the exact kinematics by central differences, and made anew in every pass.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from boom_twin import Scene, SolverError
from boom_twin.analysis.drive import STEP_TOLERANCE
from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.methods import Motion as StrokeMotion
from boom_twin.analysis.simulate import RHO
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import Plan
from boom_twin.kernels.integrators import GENERALISED_ALPHA, HAT, OFFSET, OLD, ROWS, A, V, X, prepare
from boom_twin.kernels.tables import OK, SENTENCES, Motion, State, Work
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out

SPAN = 1e-4  # rad or m, of a difference quotient
PASSES = 20


def tip_of_move(scene: Scene, move: StrokeMotion, step: float, every: int = 1, velocity_terms: bool = True) -> np.ndarray:
    """Tip (m, rad) after every `every` steps of `step` (s), shape (rows, 3), from rest; ideal pins; or SolverError.

    `velocity_terms`: Coriolis and centrifugal accelerations are in the motion, as they are in `boom_twin.simulate`.
    """
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    settle(plan, state, work, move.first, move.angles)
    scheme = prepare(GENERALISED_ALPHA, RHO, step, work.weights)
    weights, count = work.weights, round(move.duration / step)
    strokes, rates = move(np.asarray(step * np.arange(count + 1), float))
    rows = [state.history[X, plan.tables.tip : plan.tables.tip + 3].copy()]
    for k in range(1, count + 1):
        old, unknowns = state.history.copy(), len(state.z)
        hat, offset = weights[HAT, OLD:] @ old, weights[OFFSET, OLD:] @ old
        ahead = old[X] + step * (old[V] + 0.5 * step * old[A])
        state.z[:] = np.where(plan.tables.moving > 0.0, ahead[:unknowns], state.z)
        _solve(plan, state, work, (scheme.gain, scheme.rate), hat, offset, (plan.closed_lengths + strokes[k], rates[k]),
               velocity_terms)  # fmt: skip
        position = work.position.copy()
        new = np.stack([position, scheme.rate * position + offset, scheme.gain * (position - hat)])
        state.history[:] = weights[ROWS:, :OLD] @ new + weights[ROWS:, OLD:] @ old
        if k % every == 0:
            rows.append(state.history[X, plan.tables.tip : plan.tables.tip + 3].copy())
    return np.array(rows)


def _solve(
    plan: Plan,
    state: State,
    work: Work,
    scheme: tuple[float, float],
    hat: np.ndarray,
    offset: np.ndarray,
    drive: tuple[np.ndarray, np.ndarray],
    velocity_terms: bool,
) -> None:
    """Newton passes of one step; gain and rate of the `scheme`, lengths and rates of the `drive`. `hat` is written."""
    t, last = plan.tables, np.int64(len(plan.tables.operations))
    heavy, unknowns = plan.masses > 0.0, len(state.z)
    place(t, state, work)
    for _ in range(PASSES):
        if not velocity_terms:
            position = work.position.copy()
            hat[heavy] = (position - _along(plan, state, work, state.z - hat[:unknowns]))[heavy]
        clear_cut(work, FREE)
        motion = Motion(*scheme, hat, offset)
        status, _, _ = sweep_in(t, state, work, motion, *drive, ROOT, last, FREE)
        if status != OK:
            raise SolverError(f"a step fails: {SENTENCES[int(status)]}.")
        sweep_out(t, state, work, ROOT, last, FREE)
        state.z[:] += work.dz
        place(t, state, work)
        if np.max(t.scale * np.abs(work.dz)) < STEP_TOLERANCE:
            return
    raise SolverError(f"a step fails: {SENTENCES[1]}.")


def _along(plan: Plan, state: State, work: Work, increments: np.ndarray) -> np.ndarray:
    """J times `increments` of the unknowns, for all histories; the state stays."""
    z, share = state.z.copy(), SPAN / max(float(np.max(plan.tables.scale * np.abs(increments))), 1e-300)
    sides = []
    for sign in (1.0, -1.0):
        state.z[:] = z + sign * share * increments
        place(plan.tables, state, work)
        sides.append(work.position.copy())
    state.z[:] = z
    place(plan.tables, state, work)
    return np.asarray((sides[0] - sides[1]) / (2.0 * share))


def error_by_speed(scene: Scene, move: StrokeMotion, rises: tuple[float, ...], step: float = 1e-3) -> np.ndarray:
    """The move made within each of `rises` (s): fastest tip (m/s), largest and rms error of the tip (m); shape (rises, 3)."""
    found = []
    for rise in rises:
        own = replace(move, rise=rise, duration=step * round((rise + 1.0) / step))
        whole, without = (tip_of_move(scene, own, step, velocity_terms=terms)[:, :2] for terms in (True, False))
        off = np.linalg.norm(without - whole, axis=1)
        speed = np.linalg.norm(np.diff(whole, axis=0), axis=1).max() / step
        found.append((speed, off.max(), float(np.sqrt(np.mean(off**2)))))
    return np.array(found)
