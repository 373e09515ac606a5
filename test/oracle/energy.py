"""Energy and power of a boom from the arrays of its plan and state; watched from outside while it moves."""

from __future__ import annotations

import numpy as np

from boom_twin.kernels.elements.cylinder import compliance_and_lag

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
    return float(0.5 * stiffness(plan, drive) @ stretch(plan, state, drive) ** 2)


def stretch(plan, state, drive):
    """Of the oil springs, m, shape (n,)."""
    return state.history[X, plan.tables.cylinders.history] - drive


def stiffness(plan, drive):
    """Of the oil springs, N/m, shape (n,); 0 of incompressible cylinders, which store nothing."""
    compliance = plan.compliances(drive)
    return np.divide(1.0, compliance, out=np.zeros_like(compliance), where=compliance > 0.0)


def total(plan, state, drive):
    """Kinetic and potential energy, J."""
    return kinetic(plan, state) + stored(plan, state) + weight(plan, state) + oil(plan, state, drive)


def power_of_drives(plan, state, drive_rate):
    """Power that the drives put in, W: a drive that lengthens against compression (N < 0) does work.

    So does one whose oil gets stiffer on its way: the spring is as long as before, and stores more.
    """
    drive, step = state.drives[0], 1e-6
    stiffening = (stiffness(plan, drive + step) - stiffness(plan, drive - step)) / (2.0 * step)
    stiffened = 0.5 * stiffening * stretch(plan, state, drive) ** 2
    return float((stiffened - state.z[plan.tables.cylinders.z]) @ drive_rate)


def dissipation(plan, state, drive_rate):
    """Power lost in beams and oil dampers, W."""
    t, rates, loss = plan.tables, state.history[V], 0.0
    for row, beam in enumerate(t.beams):
        v = rates[beam.z : beam.z + beam.bending]
        loss += beam.beta * (v @ t.stiffness[row, : len(v), : len(v)] @ v)
        if beam.axial:
            loss += beam.beta * beam.axial_stiffness * rates[beam.z + beam.bending] ** 2
    for i, cylinder in enumerate(t.cylinders):
        compliance, lag = compliance_and_lag(cylinder, t.oils, state.drives[0, i])
        if compliance > 0.0:
            loss += lag / compliance * (rates[cylinder.history] - drive_rate[i]) ** 2
    return float(loss)
