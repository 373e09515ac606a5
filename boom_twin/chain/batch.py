"""Many booms of one structure in one call: their tables, states and work stacked along a leading axis."""

from __future__ import annotations

from ..physics.jit import inner, kernel
from .program import State, Tables, Work
from .step import run


@inner
def tables_of(b, i):
    """Tables of boom `i` of a stack; they differ in numbers only, so `tip` is common."""
    return Tables(
        b.operations[i], b.joints[i], b.linkages[i], b.links[i], b.offsets[i], b.bodies[i], b.beams[i], b.psi[i], b.weights[i],
        b.stiffness[i], b.point_mass[i], b.point_rotary[i], b.outlets[i], b.cylinders[i], b.parts[i], b.clearances[i],
        b.gravity[i], b.moving[i], b.scale[i], b.tip,
    )  # fmt: skip


@inner
def state_of(b, i):
    """State of boom `i` of a stack."""
    return State(b.z[i], b.history[i], b.frames[i], b.turns[i], b.pins[i], b.contacts[i], b.drives[i], b.pace[i])


@inner
def work_of(b, i):
    """Work of boom `i` of a stack."""
    return Work(
        b.position[i], b.hat[i], b.offset[i], b.weights[i], b.finer[i], b.s[i], b.p[i], b.g[i], b.h[i], b.own_g[i], b.own_h[i],
        b.matrix[i], b.right[i], b.gains[i], b.free[i], b.block[i], b.blocks[i], b.ends[i], b.end_gains[i],
        b.end_free[i], b.hold[i], b.apart[i], b.rho[i], b.drho[i], b.angles[i], b.turn[i], b.local[i], b.drive[i],
        b.drive_rate[i], b.dz[i], b.cut[i],
    )  # fmt: skip


@kernel
def run_each(tables, states, works, first, last, steps, counts, drives, rates, family, parameter, tolerance, passes, out, ends):
    """`run` for booms `first` .. `last - 1` of a stack.

    drives, rates : (booms, steps in all, n), m and m/s. out : (booms, rows, 2 n + 9 + 4 pins), see `run`.
    ends : ndarray of int, shape (booms, 3): status, row, passes of each, see `run`.
    """
    for i in range(first, last):
        status, row, total, _, _ = run(
            tables_of(tables, i), state_of(states, i), work_of(works, i), steps, counts, drives[i], rates[i],
            family, parameter, tolerance, passes, None, out[i],
        )  # fmt: skip
        ends[i, 0], ends[i, 1], ends[i, 2] = status, row, total
