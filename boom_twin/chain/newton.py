"""Newton passes to equilibrium at one instant: place, sweep in, sweep out, until the increments are small."""

from __future__ import annotations

import math

from ..physics.jit import inner, kernel
from .place import place
from .sweep import SWEPT, sweep_in, sweep_out

OK, NOT_CONVERGED, SINGULAR, NOT_FINITE = 0, 1, 2, 3


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
def newton(t, state, work, motion, drive, drive_rate, tolerance, passes, longest):
    """Solve the boom's equations for `state.z`, starting from the values there.

    Parameters
    ----------
    tolerance : float
        Done once the largest increment (rad) is below it; convergence is quadratic, so the error left is its square.
    passes : int
        At most so many; a single pass is the papers' linearised step and counts as converged.
    longest : float
        Increments are shortened so that none exceeds this (rad).

    Returns
    -------
    status, passes, last increment (rad)
    """
    size = 0.0
    place(t, state, work)
    for k in range(passes):
        status, _ = sweep_in(t, state, work, motion, drive, drive_rate)
        if status != SWEPT:
            return SINGULAR, k + 1, size
        sweep_out(t, state, work)
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
