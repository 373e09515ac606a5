"""Plain product of transfer matrices from base to tip, as in the papers. It shows where this form loses digits.

A unit is the part between two cuts without carried columns: one element, or all from a pin C through its six-bar. At the
output cut the force is f_O = f_0 + df. The sweep inwards keeps df as three more degrees of freedom and gives

    f_I = S_ee de_I + S_ef df + p_e,      de_O = S_fe de_I + S_ff df + p_f.

Solved for the output, this is the transfer matrix of the unit, [de_O, f_O, 1] = U [de_I, f_I, 1]. The elements are those of the
Riccati sweep. The product of all U maps the cut behind substructure A to the free tip. The force there is zero. This gives
the increments at the base. Multiplication outwards then gives all cuts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...types import Array
from ..jit import inner
from ..plane_algebra import solve
from ..tables import DIGITS_LOST, JOINT_B, OK, ROD_PIN, SINGULAR, STATION, Z_FORCE_A, Tables
from .riccati_sweep import clear_cut, sweep_in, sweep_out


class Product(NamedTuple):
    """Working arrays of the plain product for a boom of k units."""

    bounds: np.ndarray  # (k + 1,), first operation of each unit, and the end
    u: Array  # (k, 6, 7), transfer matrices; that of the first unit, substructure A, is not used
    force: Array  # (k, 3), force and torque at the output of every unit after the last pass, N and N m
    total: Array  # (6, 7), scratch like the next four
    other: Array
    a: Array
    right: Array
    order: np.ndarray
    z: Array  # (7,), state vector in the first 6 entries


def new_product(t: Tables) -> Product:
    """Return working arrays, with cuts where neither a pin C nor the force of cylinder 1 is carried."""
    kinds = t.operations.kind
    carried, bounds = 1, [1]
    for k, kind in enumerate(kinds[1:], 1):
        carried += {STATION: 1, JOINT_B: -1, ROD_PIN: -1}.get(int(kind), 0)
        if carried == 0:
            bounds.append(k + 1)
    units = len(bounds) - 1
    return Product(
        np.array(bounds, np.int64), np.zeros((units, 6, 7)), np.zeros((units, 3)), np.zeros((6, 7)), np.zeros((6, 7)),
        np.zeros((5, 5)), np.zeros((5, 7)), np.zeros(5, np.int64), np.zeros(7),
    )  # fmt: skip


@inner
def open_end(work, force):
    """Begin at the output cut of a unit, with force `force` (3,) and df as three more degrees of freedom."""
    clear_cut(work, 6)
    for i in range(3):
        work.p[i] = force[i]
        work.s[i, 3 + i] = 1.0
        work.s[3 + i, i] = 1.0


@inner
def transfer_matrix(s, p, force, a, right, order, u):
    """Write U (6, 7) of a unit from its condensed (s, p), 6 degrees of freedom; return False if S_ef is singular."""
    for i in range(3):
        for j in range(3):
            a[i, j] = s[i, 3 + j]
            right[i, j] = -s[i, j]
            right[i, 3 + j] = 1.0 if i == j else 0.0
        right[i, 6] = -p[i]
    if not solve(a, right, 3, 7, order):
        return False
    for i in range(3):
        for j in range(7):
            value = right[i, j]
            u[3 + i, j] = value
            u[i, j] = s[3 + i, j] if j < 3 else p[3 + i] if j == 6 else 0.0
        u[3 + i, 6] += force[i]
    for i in range(3):
        for k in range(3):
            for j in range(7):
                u[i, j] += s[3 + i, 3 + k] * right[k, j]
    return True


@inner
def multiply(left, right, out):
    """Write out = left right for affine maps (6, 7)."""
    for i in range(6):
        for j in range(7):
            value = left[i, 6] if j == 6 else 0.0
            for k in range(6):
                value += left[i, k] * right[k, j]
            out[i, j] = value


@inner
def close_root(work, product):
    """Solve for the increments of joint A and of the force behind substructure A, by a free tip; return False if singular.

    Degrees of freedom of the condensed substructure A: x, y (fixed), theta, the force behind it (3), N.
    """
    s, p, total, a, right = work.s, work.p, product.total, product.a, product.right
    for row in range(2):
        at = 2 + 4 * row  # theta, N
        a[row, 0], a[row, 1], right[row, 0] = s[at, 2], s[at, 6], -p[at]
        for j in range(3):
            a[row, 2 + j] = s[at, 3 + j]
    for i in range(3):
        right[2 + i, 0] = -total[3 + i, 6]
        for j in range(5):
            a[2 + i, j] = 0.0
        for k in range(3):
            weight = total[3 + i, k]
            right[2 + i, 0] -= weight * p[3 + k] + total[3 + i, 3 + k] * product.force[0, k]
            a[2 + i, 0] += weight * s[3 + k, 2]
            a[2 + i, 1] += weight * s[3 + k, 6]
            for j in range(3):
                a[2 + i, 2 + j] += weight * s[3 + k, 3 + j]
        for j in range(3):
            a[2 + i, 2 + j] += total[3 + i, 3 + j]
    return solve(a, right, 5, 1, product.order)


@inner
def plain_pass(t, state, work, motion, drive, drive_rate, product):
    """Write the increments of all unknowns into `work.dz`; return OK, SINGULAR or DIGITS_LOST."""
    bounds, u, force, total, other, z = product.bounds, product.u, product.force, product.total, product.other, product.z
    units = force.shape[0]
    for i in range(6):
        for j in range(7):
            total[i, j] = 1.0 if i == j else 0.0
    for k in range(units - 1, -1, -1):
        open_end(work, force[k])
        status, _, _ = sweep_in(t, state, work, motion, drive, drive_rate, bounds[k], bounds[k + 1], 6)
        if status != OK:
            return SINGULAR
        if k > 0:
            if not transfer_matrix(work.s, work.p, force[k], product.a, product.right, product.order, u[k]):
                return SINGULAR
            multiply(total, u[k], other)
            for i in range(6):
                for j in range(7):
                    total[i, j] = other[i, j]
    s, p, right = work.s, work.p, product.right
    if not close_root(work, product):
        return SINGULAR
    theta, n = right[0, 0], right[1, 0]
    at = t.joints[0].z
    work.dz[at], work.dz[at + 1] = theta, n
    cut = work.cut
    cut[0], cut[1], cut[2], cut[6] = 0.0, 0.0, theta, n
    for i in range(3):
        change = right[2 + i, 0]
        cut[3 + i] = change
        z[i], z[3 + i] = s[3 + i, 2] * theta + s[3 + i, 6] * n + p[3 + i], force[0, i] + change
        for j in range(3):
            z[i] += s[3 + i, 3 + j] * right[2 + j, 0]
        force[0, i] = z[3 + i]
    sweep_out(t, state, work, bounds[0], bounds[1], 7)
    return multiply_out(t, state, work, product)


@inner
def multiply_out(t, state, work, product):
    """Compute every cut from the one inboard of it, and the increments inside the units."""
    bounds, force, z, cut = product.bounds, product.force, product.z, work.cut
    largest = abs(state.z[t.joints[0].z + Z_FORCE_A])
    for k in range(1, force.shape[0]):
        u, new = product.u[k], product.other[0]
        for i in range(6):
            new[i] = u[i, 6]
            for j in range(6):
                new[i] += u[i, j] * z[j]
        for i in range(3):
            cut[i], cut[3 + i] = z[i], new[3 + i] - force[k, i]
            largest = max(largest, abs(z[3 + i]))
        for i in range(6):
            z[i] = new[i]
        for i in range(3):
            force[k, i] = z[3 + i]
        sweep_out(t, state, work, bounds[k], bounds[k + 1], 6)
    left = max(abs(z[3]), abs(z[4]), abs(z[5]))
    return OK if left <= 1e-6 * largest else DIGITS_LOST  # nothing acts at the free tip
