"""Natural modes of a posture from those of a posture near it: one step of subspace iteration.

The sweeps are at a negative square of the frequency (K.-J. Bathe, Finite Element Procedures, ch. 11). A `Posture` holds the
modes, see `boom_twin.deviation.posture`.
"""

from __future__ import annotations

import math

from ..kernels.jit import inner
from ..kernels.tables import Motion
from ..kernels.transfer.forward_kinematics import place
from ..kernels.transfer.riccati_sweep import FREE, ROOT, sweep_out
from ..kernels.transfer.vibration import condense

NUDGE = 1e-6  # rad, largest change of an unknown that derivatives of positions are taken over
LOAD = 1e-9  # m, displacement whose inertia loads the boom in a step of subspace iteration
SWEEPS = 30  # of Jacobi rotations, at most


@inner
def restore(t, boom, work, p):
    """Put the boom back to rest."""
    for i in range(boom.z.shape[0]):
        boom.z[i] = p.rest[i]
    place(t, boom, work)


@inner
def nudge_of(t, increments):
    """Return how many of these increments of the unknowns turn none of them by more than `NUDGE`."""
    largest = 1e-300
    for i in range(increments.shape[0]):
        largest = max(largest, t.scale[i] * abs(increments[i]))
    return NUDGE / largest


@inner
def iterate_modes(t, boom, work, p):
    """Update the modes to the present posture: (K + s^2 M) y_j = s^2 M phi_j, then Rayleigh-Ritz in the span of the y_j."""
    n, m = p.drives.shape[0], p.modes[0]
    if m == 0:
        return
    shift2 = p.omega[0] * p.omega[0]
    for j in range(m):
        respond_to_inertia(t, boom, work, p, j, shift2)
    for j in range(m):
        move_along(t, boom, work, p, j)
    mass, stiffness, turned, inverse = p.small[0], p.small[1], p.small[2], p.small[3]
    for j in range(m):
        scale = 1.0 / math.sqrt(weigh(p, p.shifted[j], p.shifted[j]))
        turned[0, j] = scale
        for i in range(p.shifted.shape[1]):
            p.shifted[j, i] *= scale
        for i in range(p.response.shape[1]):
            p.response[j, i] *= scale
    for j in range(m):
        for k in range(m):
            stiffness[j, k] = shift2 * weigh(p, p.shifted[j], p.motions[k]) * turned[0, k]
    for j in range(m):
        for k in range(m):
            mass[j, k] = weigh(p, p.shifted[j], p.shifted[k])
    for j in range(m):
        for k in range(j + 1):
            both = 0.5 * (stiffness[j, k] + stiffness[k, j])
            stiffness[j, k] = stiffness[k, j] = both
    for j in range(m):
        for k in range(m):
            stiffness[j, k] -= shift2 * mass[j, k]
    solve_small(mass, stiffness, inverse, m)
    for j in range(m):
        p.omega[j] = math.sqrt(max(stiffness[j, j], 1e-12))
        combine(p.shifted, inverse, j, m, p.motions[j])
        combine(p.response, inverse, j, m, p.columns[2 + n + j])
    for j in range(m):
        scale = 1.0 / math.sqrt(weigh(p, p.motions[j], p.motions[j]))
        for i in range(p.motions.shape[1]):
            p.motions[j, i] *= scale
        for i in range(p.columns.shape[1]):
            p.columns[2 + n + j, i] *= scale


@inner
def respond_to_inertia(t, boom, work, p, j, shift2):
    """Write the unknowns' answer to the inertia of mode `j` in motion at the square -`shift2` of its frequency."""
    for i in range(p.drives.shape[0]):
        work.drive[i], work.drive_rate[i] = p.closed[i] + p.drives[i], 0.0
    for sign in (1.0, -1.0):
        for i in range(p.hat.shape[0]):
            p.hat[i] = p.position[i] + sign * LOAD * p.motions[j, i]
        condense(t, boom, work, Motion(shift2, 0.0, p.hat, p.still, True), work.drive, work.drive_rate)
        sweep_out(t, boom, work, ROOT, t.operations.shape[0], FREE)
        for i in range(boom.z.shape[0]):
            found = work.dz[i] / (2.0 * LOAD)
            p.response[j, i] = found if sign > 0.0 else p.response[j, i] - found


@inner
def move_along(t, boom, work, p, j):
    """Write how all mass points move with the unknowns of response `j`."""
    size = nudge_of(t, p.response[j])
    for sign in (1.0, -1.0):
        for i in range(boom.z.shape[0]):
            boom.z[i] = p.rest[i] + sign * size * p.response[j, i]
        place(t, boom, work)
        for i in range(p.shifted.shape[1]):
            found = work.position[i] / (2.0 * size)
            p.shifted[j, i] = found if sign > 0.0 else p.shifted[j, i] - found
    restore(t, boom, work, p)


@inner
def weigh(p, one, other):
    """Return the modal mass of two motions (h,), kg."""
    total = 0.0
    for i in range(one.shape[0]):
        total += p.masses[i] * one[i] * other[i]
    return total


@inner
def combine(vectors, weights, j, m, found):
    """Write the sum of vectors (m, k) by column `j` of the weights."""
    for i in range(found.shape[0]):
        total = 0.0
        for k in range(m):
            total += weights[k, j] * vectors[k, i]
        found[i] = total


@inner
def solve_small(mass, stiffness, vectors, m):
    """Solve the eigenproblem of two symmetric matrices (m, m) that are nearly diagonal; order and signs stay.

    The mass becomes the unit matrix by Gram and Schmidt, then the stiffness a diagonal by Jacobi rotations of at most 45
    degrees. `stiffness` then has the eigenvalues, column j of `vectors` their vectors in the basis that was given.
    """
    for j in range(m):
        for k in range(m):
            vectors[j, k] = 1.0 if j == k else 0.0
    for j in range(m):
        for k in range(j):
            add_column(mass, stiffness, vectors, m, j, k, -mass[k, j] / mass[k, k])
        scale = 1.0 / math.sqrt(max(mass[j, j], 1e-300))
        for i in range(m):
            vectors[i, j] *= scale
        for i in range(m):
            mass[i, j] *= scale
            stiffness[i, j] *= scale
        for i in range(m):
            mass[j, i] *= scale
            stiffness[j, i] *= scale
    for _ in range(SWEEPS):
        largest = 0.0
        for j in range(m):
            for k in range(j):
                largest = max(largest, abs(stiffness[j, k]) / math.sqrt(abs(stiffness[j, j] * stiffness[k, k]) + 1e-300))
                rotate(stiffness, vectors, m, j, k)
        if largest < 1e-14:
            return


@inner
def add_column(mass, stiffness, vectors, m, j, k, share):
    """Add a share of basis vector k to basis vector j."""
    for i in range(m):
        vectors[i, j] += share * vectors[i, k]
    for i in range(m):
        mass[i, j] += share * mass[i, k]
        stiffness[i, j] += share * stiffness[i, k]
    for i in range(m):
        mass[j, i] += share * mass[k, i]
        stiffness[j, i] += share * stiffness[k, i]


@inner
def rotate(a, vectors, m, j, k):
    """Make the entry (j, k) of a symmetric matrix zero by the smaller rotation."""
    if a[j, k] == 0.0:
        return
    apart = (a[k, k] - a[j, j]) / (2.0 * a[j, k])
    tangent = (1.0 if apart >= 0.0 else -1.0) / (abs(apart) + math.sqrt(apart * apart + 1.0))
    c = 1.0 / math.sqrt(tangent * tangent + 1.0)
    s = tangent * c
    for i in range(m):
        one, other = a[i, j], a[i, k]
        a[i, j], a[i, k] = c * one - s * other, s * one + c * other
    for i in range(m):
        one, other = a[j, i], a[k, i]
        a[j, i], a[k, i] = c * one - s * other, s * one + c * other
    for i in range(m):
        one, other = vectors[i, j], vectors[i, k]
        vectors[i, j], vectors[i, k] = c * one - s * other, s * one + c * other


@inner
def modal_loss(t, p, increments):
    """Return 2 zeta omega (1/s) of a mode by the power that oil dampers, beams and base take from it."""
    loss = 0.0
    for i in range(p.drives.shape[0]):
        force = increments[t.cylinders[i].z]
        loss += p.lag[i] * p.compliance[i] * force * force
    for k in range(t.hinges.shape[0]):
        turn = increments[t.hinges[k].z]
        loss += t.hinges[k].damping * turn * turn
    for row in range(t.beams.shape[0]):
        beam = t.beams[row]
        for i in range(beam.bending):
            for k in range(beam.bending):
                loss += beam.beta * increments[beam.z + i] * t.stiffness[row, i, k] * increments[beam.z + k]
        if beam.axial > 0:
            loss += beam.beta * beam.axial_stiffness * increments[beam.z + beam.bending] ** 2
    return loss
