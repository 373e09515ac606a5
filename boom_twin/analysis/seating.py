"""Pins with clearance at rest: held as if ideal, then let go to where they lie, then linearised there if the scene says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..chain.clearance import axis_of
from ..chain.program import State
from ..physics.contact import APPROACH, CLOSED, DAMPER, FORCE, NEAR, SEAT_X, SEAT_Y, SLOWEST, SPRING, penetration
from ..physics.integrators import X
from ..plan.plan import Plan

CLAMP = 1e12  # N/m, a pin that is as good as ideal


def clamp_pins(state: State) -> None:
    """Hold all journals in the middle of their bushes."""
    state.contacts[:] = 0.0
    state.contacts[:, SPRING] = CLAMP


def release_pins(plan: Plan, state: State) -> None:
    """Let contact hold every clamped journal, as deep in its bush as its force presses it, with no clearance yet."""
    for row, memory in zip(plan.tables.clearances, state.contacts, strict=True):
        offset = state.z[row.z : row.z + 2]
        distance = float(np.hypot(*offset))
        if distance > 0.0:
            offset *= (CLAMP * distance / row.stiffness) ** (1.0 / row.exponent) / distance
        memory[SPRING], memory[CLOSED], memory[APPROACH] = 0.0, 1.0, SLOWEST


def loosen_pins(plan: Plan, state: State, share: float, more: float) -> Plan:
    """Move every journal outwards by `more` of its clearance; returns the boom with `share` of all clearances."""
    worn = plan.tables.clearances.copy()
    for row in worn:
        offset = state.z[row.z : row.z + 2]
        distance = float(np.hypot(*offset))
        if distance > 0.0:
            offset *= 1.0 + more * row.gap / distance
        state.history[X, row.z : row.z + 2] = offset
        row.gap *= share
    return replace(plan, tables=plan.tables._replace(clearances=worn))


def linearise_pins(plan: Plan, state: State) -> None:
    """Note which pins touch, and give those that are to be linear their spring and damper at the present force."""
    for row, memory in zip(plan.tables.clearances, state.contacts, strict=True):
        offset = state.z[row.z : row.z + 2]
        distance = float(np.hypot(*offset))
        memory[CLOSED] = float(distance > row.gap - NEAR)
        _, _, _, depth, _ = penetration(row, *offset)
        memory[FORCE] = row.stiffness * depth**row.exponent
        if row.linear:
            memory[SPRING] = row.exponent * memory[FORCE] / depth
            memory[DAMPER] = row.loss * memory[FORCE] / SLOWEST
            x, y = offset * (1.0 - memory[FORCE] / (memory[SPRING] * distance))
            c, s = axis_of(plan.tables, state, row)
            memory[SEAT_X], memory[SEAT_Y] = c * x + s * y, c * y - s * x
