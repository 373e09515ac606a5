"""Energy and power of a boom from the arrays of its plan and state; watched from outside while it moves."""

from __future__ import annotations

X, V = -4, -3  # rows of positions and velocities in a history


def kinetic(plan, state):
    """Of all mass points and inertias, J."""
    return 0.5 * plan.masses @ state.history[V] ** 2


def stored(plan, state):
    """Of bent and stretched beams, J."""
    t, total = plan.tables, 0.0
    for row, beam in enumerate(t.beams):
        q = state.z[beam.z : beam.z + beam.bending]
        total += 0.5 * q @ t.stiffness[row, : len(q), : len(q)] @ q
        if beam.axial:
            total += 0.5 * beam.axial_stiffness * state.z[beam.z + beam.bending] ** 2
    return total


def weight(plan, state):
    """Potential energy of gravity, J."""
    return -plan.weights @ state.history[X]


def oil(plan, state, drive):
    """Energy of the oil springs at drive lengths (n,), J."""
    stretch = state.history[X, plan.tables.cylinders.history] - drive
    compliance = plan.tables.cylinders.compliance
    return float(sum(0.5 * s**2 / c for s, c in zip(stretch, compliance, strict=True) if c > 0.0))


def total(plan, state, drive):
    """Kinetic and potential energy, J."""
    return kinetic(plan, state) + stored(plan, state) + weight(plan, state) + oil(plan, state, drive)


def power_of_drives(plan, state, drive_rate):
    """Power that the drives put in, W: a drive that lengthens against compression (N < 0) does work."""
    return float(-state.z[plan.tables.cylinders.z] @ drive_rate)


def dissipation(plan, state, drive_rate):
    """Power lost in beams and oil dampers, W."""
    t, rates, loss = plan.tables, state.history[V], 0.0
    for row, beam in enumerate(t.beams):
        v = rates[beam.z : beam.z + beam.bending]
        loss += beam.beta * (v @ t.stiffness[row, : len(v), : len(v)] @ v)
        if beam.axial:
            loss += beam.beta * beam.axial_stiffness * rates[beam.z + beam.bending] ** 2
    for i, cylinder in enumerate(t.cylinders):
        if cylinder.compliance > 0.0:
            loss += cylinder.lag / cylinder.compliance * (rates[cylinder.history] - drive_rate[i]) ** 2
    return float(loss)
