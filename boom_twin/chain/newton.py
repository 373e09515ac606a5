"""Newton passes to equilibrium at one instant: place, sweep in, sweep out, until the increments are small."""

from __future__ import annotations

import math

import numpy as np

from ..physics.jit import inner, kernel
from .place import place
from .plain import plain_pass
from .sweep import FREE, SWEPT, clear_cut, sweep_in, sweep_out

OK, NOT_CONVERGED, NOT_FINITE = 0, 1, 3  # 2 and 4: see `chain.sweep`, `chain.plain`
ROOT = np.int64(0)  # the first operation


@inner
def largest(scale, dz):
    """Largest increment as an angle (rad); NaN if any increment is not finite."""
    size = 0.0
    for i in range(dz.shape[0]):
        if not math.isfinite(dz[i]):
            return math.nan
        size = max(size, scale[i] * abs(dz[i]))
    return size


@kernel
def riccati_in(t, state, work, motion, drive, drive_rate):
    """Condense the whole boom from the free tip to the base.

    Returns status, and the number of negative pivots in the beams (joints: see `Work.blocks`).
    """
    clear_cut(work, FREE)
    status, negative, _ = sweep_in(t, state, work, motion, drive, drive_rate, ROOT, t.operations.shape[0], FREE)
    return status, negative


@kernel
def riccati_out(t, state, work):
    """Increments of all unknowns into `work.dz`."""
    sweep_out(t, state, work, ROOT, t.operations.shape[0], FREE)


@kernel
def newton(t, state, work, motion, drive, drive_rate, tolerance, passes, longest, product):
    """Solve the boom's equations for `state.z`, starting from the values there.

    Parameters
    ----------
    tolerance : float
        Done once the largest increment (rad) is below it; convergence is quadratic, so the error left is its square.
    passes : int
        At most so many; a single pass is the papers' linearised step and counts as converged.
    longest : float
        Increments are shortened so that none exceeds this (rad).
    product : Product or None
        None for the Riccati sweep; else room for the plain product of transfer matrices (see `chain.plain`).

    Returns
    -------
    status, passes, last increment (rad)
    """
    size = 0.0
    place(t, state, work)
    for k in range(passes):
        if product is None:
            status, _ = riccati_in(t, state, work, motion, drive, drive_rate)
            if status == SWEPT:
                riccati_out(t, state, work)
        else:
            status = plain_pass(t, state, work, motion, drive, drive_rate, product)
        if status != SWEPT:
            return status, k + 1, size
        size = largest(t.scale, work.dz)
        if not math.isfinite(size):
            return NOT_FINITE, k + 1, size
        share = 1.0
        if size > longest:
            share = longest / size
        for i in range(state.z.shape[0]):
            state.z[i] += share * work.dz[i]
        place(t, state, work)
        if size < tolerance or passes == 1:
            return OK, k + 1, size
    return NOT_CONVERGED, passes, size
