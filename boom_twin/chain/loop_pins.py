"""Pivots and link pins with clearance in a six-bar's system: two more unknowns each, behind the six.

The offset of a pin's journal moves all that hangs on it, as the head's pivot would. So its rows are those of the head's pivot
as far as they come from these parts, which are therefore assembled in turn: link L, link R, section i.
"""

from __future__ import annotations

import numpy as np

from ..physics.contact import LINK_L_PIN, LINK_R_PIN, PIVOT, Q_PIN
from ..physics.jit import inner
from .clearance import add_turning

# places in the loop's system: pivot x, y; turn of the head; pin C x, y | section, links, lambda, N
HEAD, PIN_C, SECTION, ALPHA_L, ALPHA_R, LAMBDA, FORCE, SIZE = 2, 3, 5, 6, 7, 8, 10, 11
INNER = np.int64(6)  # typed, because numba compiles once more for every literal


@inner
def keep_rows(apart, g, h, size):
    """Keep force and tangent of the head's pivot, as assembled so far."""
    for i in range(2):
        apart[i, size] = g[i]
        for j in range(size):
            apart[i, j] = h[max(i, j), min(i, j)]


@inner
def take_rows(t, work, joint, place, size, g, h):
    """Rows of the offset of pin `place`: those of the head's pivot less the kept ones, and the pin's own force."""
    apart = work.apart
    for k in range(joint.clearances):
        row = joint.first_clearance + k
        if t.clearances[row].place != place:
            continue
        at, hold = SIZE + 2 * k, work.hold[row]
        for i in range(2):
            g[at + i] += g[i] - apart[i, size] + hold[i]
            for j in range(size):
                value = h[max(i, j), min(i, j)] - apart[i, j]
                if j < at:
                    h[at + i, j] += value
                elif j > at + 1:
                    h[j, at + i] += value
            for j in range(i + 1):
                h[at + i, at + j] += h[i, j] - apart[i, j] + hold[2 + i + j]


@inner
def free_pins(t, state, work, joint, g, h):
    """Closure of pin Q with all offsets, the force of pin Q's own, and friction in all four pins."""
    lx, ly = state.z[joint.z + 3], state.z[joint.z + 4]
    for k in range(joint.clearances):
        row = joint.first_clearance + k
        place, hold, at = t.clearances[row].place, work.hold[row], SIZE + 2 * k
        sign = 1.0 if place in (LINK_L_PIN, Q_PIN) else -1.0
        g[at] += sign * lx
        g[at + 1] += sign * ly
        dx, dy = state.z[t.clearances[row].z], state.z[t.clearances[row].z + 1]
        g[LAMBDA] += sign * dx
        g[LAMBDA + 1] += sign * dy
        h[at, LAMBDA] += sign
        h[at + 1, LAMBDA + 1] += sign
        if place == Q_PIN:
            for i in range(2):
                g[at + i] += hold[i]
                for j in range(i + 1):
                    h[at + i, at + j] += hold[2 + i + j]
        journal = SECTION if place == PIVOT else ALPHA_L if place == LINK_L_PIN else ALPHA_R
        bush = SECTION if place == LINK_R_PIN else ALPHA_L if place == Q_PIN else HEAD
        g[journal] += hold[5]
        g[bush] -= hold[5]
        add_turning(hold, h, at, journal, bush)
