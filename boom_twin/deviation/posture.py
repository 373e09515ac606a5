"""Linearisation of a boom about static equilibrium: small changes by drives, a force at the tip, and natural modes.

With the drives d, a force f at the tip and modal coordinates q (unit modal mass), the unknowns of the boom are

    z = z_0 + sum_i Z_i (d_i - d_0i) + sum_a R_a f_a + sum_j S_j q_j,
    q_j'' + c_j q_j' + omega_j^2 q_j = phi_j . f - sum_i N_ji / omega_j^2 d_i'',

Z_i and Z_a static responses to a unit of a drive and of the force, S_j mode shapes, phi_j their motion of the tip, N_ji their
forces in the cylinders, R_a = Z_a - sum_j phi_ja / omega_j^2 S_j the static response that the modes leave out. What sensors
read changes by the same columns. When the posture moves, modes follow by one step of subspace iteration from those before
(K.-J. Bathe, Finite Element Procedures, ch. 11) on sweeps at a negative square of the frequency.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.equilibrium import LONGEST_INCREMENT, PASSES, TOLERANCE
from ..compiler.plan import Plan
from ..kernels.elements.beam import point_on_axis
from ..kernels.elements.cylinder import compliance_and_lag
from ..kernels.elements.linkage import angle_of_length, cylinder_length
from ..kernels.integrators import REST, prepare
from ..kernels.jit import by_reference, inner, kernel
from ..kernels.tables import FRAME_ANGLE, FRAME_COS, FRAME_SIN, FRAME_X, FRAME_Y, JOINT_A, JOINT_B, OK, Motion
from ..kernels.transfer.clearance_pins import load_pins
from ..kernels.transfer.forward_kinematics import place
from ..kernels.transfer.natural_frequency import condense
from ..kernels.transfer.riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out
from ..kernels.transfer.time_step import ANEW, advance
from ..types import Array, StrokeReading
from .channels import TIP_IMU_STATES, Measurement
from .sensor_model import Mounting

FORCE_SIZE = 1.0  # N
DRIVE_SIZE = 1e-6  # m, loads that differences are taken over
NUDGE = 1e-6  # rad, largest change of an unknown that derivatives of positions are taken over
LOAD = 1e-9  # m, displacement whose inertia loads the boom in a step of subspace iteration
WIDEST = math.pi  # rad, range in which a joint angle is looked for
CURVATURE_STEP = 1e-4  # rad
SWEEPS = 30  # of Jacobi rotations, at most


@by_reference
class Posture(NamedTuple):
    """Boom at rest and its first-order changes; n joints, m modes, u unknowns, h histories, c = 2 + n + m columns.

    Columns: force at the tip along x and y (the part that no mode has), the drives, the modes.

    modes : (1,) how many. drives : (n,) strokes of the drives at rest, m. angles : (n,) of the rigid boom there, rad.
    rest : (u,) unknowns at rest. columns : (c, u) their changes. motions : (m, h) of every mass point.
    readings : (c, 2 n + 3 sites) changes of what angle sensors read (rad), of x, y, angle of every site of
    `boom_twin.deviation.channels`, the tip first, and of the angles of the sections' chords, from pivot to pivot.
    forces : (c, n) of the cylinders, N. moments : (c, stations) of bending, N m.
    read, pulled : (2 n + 3 sites,), (n,) angles to forces at rest.
    omega, decay : (m,) rad/s and 2 zeta omega, 1/s. compliance, lag : (n,) 1/k (m/N; 0 if rigid) and d/k (s).
    oil_read : (n,) the compliance where stroke transducers read lengths, 0 where they read drives (`reads_drive`).
    reads_angle : whether the model is driven by angles. tilt : (n,) angle of the base, for inclinometers. gravity : (2,) m/s^2.
    slope, curvature : (n,) change of a joint's angle by its stroke, rad/m, and of that, rad/m^2.
    frames, absolute, sways : (n,) of angle sensors, see `Mounting`. roots : (n + 1,)
    frames of the pivots and of the tip. masses : (h,) kg, kg m^2. lengths : (n,) of the sections, m. closed : (n,) m.
    channels, sites, errors, psi, weights, bending : see `boom_twin.deviation.channels.Measurement`.
    behind : (1,) states of sensors' errors that the estimate has beside those of the prediction. delayed : (1,) copies of late
    readings behind these, see `boom_twin.deviation.delayed`.
    The other fields are scratch; `rate` (n,) stays zero.
    """

    modes: NDArray[np.int64]
    drives: Array
    angles: Array
    rest: Array
    columns: Array
    motions: Array
    readings: Array
    forces: Array
    moments: Array
    read: Array
    pulled: Array
    omega: Array
    decay: Array
    compliance: Array
    lag: Array
    oil_read: Array
    reads_drive: bool
    reads_angle: bool
    tilt: Array
    gravity: Array
    slope: Array
    curvature: Array
    frames: NDArray[np.int64]
    absolute: NDArray[np.bool_]
    sways: NDArray[np.bool_]
    roots: NDArray[np.int64]
    masses: Array
    lengths: Array
    closed: Array
    channels: np.recarray
    sites: np.recarray
    errors: np.recarray
    psi: Array
    weights: Array
    bending: Array
    behind: NDArray[np.int64]
    delayed: NDArray[np.int64]
    still: Array
    position: Array
    hat: Array
    response: Array
    sides: Array
    shifted: Array
    small: Array
    target: Array
    rate: Array


def new_posture(
    plan: Plan, most: int, lengths: Array, mounting: Mounting, measured: Measurement, reads: StrokeReading, inclination: float
) -> Posture:
    """Return room for a boom whose sections are `lengths` (m) long, with `most` modes at most.

    `mounting` is that of the angle sensors. `reads` is the quantity that drives the model, `inclination` (rad) is the base's.
    """
    n, unknowns, histories = plan.joints, len(plan.names), len(plan.masses)
    width = 2 * n + 3 * len(measured.sites)
    kinds, columns = plan.tables.operations.kind, 2 + n + most
    roots = np.append(np.flatnonzero((kinds == JOINT_A) | (kinds == JOINT_B)) + 1, len(kinds))
    return Posture(
        modes=np.zeros(1, np.int64), drives=np.full(n, np.inf), angles=np.zeros(n), rest=np.zeros(unknowns),
        columns=np.zeros((columns, unknowns)), motions=np.zeros((most, histories)), readings=np.zeros((columns, width)),
        forces=np.zeros((columns, n)), moments=np.zeros((columns, len(measured.bending))),
        read=np.zeros(width), pulled=np.zeros(n), omega=np.zeros(most),
        decay=np.zeros(most), compliance=np.zeros(n), lag=np.zeros(n),
        oil_read=np.zeros(n), reads_drive=reads is StrokeReading.DRIVE, reads_angle=reads is StrokeReading.ANGLE,
        tilt=np.where(mounting.absolute, inclination, 0.0), gravity=np.array(plan.tables.gravity), slope=np.zeros(n),
        curvature=np.zeros(n), frames=mounting.frames.astype(np.int64), absolute=mounting.absolute, sways=mounting.sways,
        roots=roots.astype(np.int64), masses=plan.masses,
        lengths=lengths, closed=plan.closed_lengths, **measured._asdict(),
        behind=np.array([TIP_IMU_STATES + 2 * n]), delayed=np.zeros(1, np.int64),
        still=np.zeros(histories), position=np.zeros(histories), hat=np.zeros(histories),
        response=np.zeros((most, unknowns)), sides=np.zeros((2, width)),
        shifted=np.zeros((most, histories)), small=np.zeros((4, most, most)), target=np.zeros(n), rate=np.zeros(n),
    )  # fmt: skip


@kernel
def settle_at(t, boom, work, p, drives):
    """Settle `boom` (State) at the strokes `drives` (n,) of the drives, starting from the rest before; return the status."""
    for i in range(drives.shape[0]):
        p.drives[i], p.target[i] = drives[i], p.closed[i] + drives[i]
    scheme = prepare(REST, 0.0, 0.0, work.weights)
    status, _, _ = advance(t, boom, work, scheme, p.target, p.rate, TOLERANCE, PASSES, LONGEST_INCREMENT, None, ANEW)
    return status


@kernel
def linearise(t, boom, work, p, drives, follow):
    """Linearise about rest at the strokes `drives` (n,) of the drives; return the status.

    Parameters
    ----------
    t, boom, work : Tables, State, Work
        `boom` is at rest near there, and is brought to rest.
    p : Posture
        Written.
    follow : bool
        Whether the modes in `p`, which are of a posture near, are brought to this one; else they are taken as they are.
    """
    status = settle_at(t, boom, work, p, drives)
    if status != OK:
        return status
    n, m = drives.shape[0], p.modes[0]
    for i in range(boom.z.shape[0]):
        p.rest[i] = boom.z[i]
    place(t, boom, work)
    for i in range(p.position.shape[0]):
        p.position[i] = work.position[i]
    for i in range(n):
        cylinder = t.cylinders[i]
        p.pulled[i] = boom.z[cylinder.z]
        p.compliance[i], p.lag[i] = compliance_and_lag(cylinder, t.oils, p.closed[i] + drives[i])
        p.oil_read[i] = 0.0 if p.reads_drive else p.compliance[i]
    note_linkages(t, p)
    respond_statically(t, boom, work, p)
    if follow:
        iterate_modes(t, boom, work, p)
    for j in range(m):
        p.decay[j] = modal_loss(t, p, p.columns[2 + n + j])
    restore(t, boom, work, p)
    read_sensors(t, boom, p, p.read)
    for k in range(2 + n + m):
        change_readings(t, boom, work, p, k)
        for i in range(n):
            p.forces[k, i] = p.columns[k, t.cylinders[i].z]
        for i in range(p.bending.shape[0]):
            p.moments[k, i] = 0.0
            for j in range(boom.z.shape[0]):
                p.moments[k, i] += p.bending[i, j] * p.columns[k, j]
    leave_modes_out(p)
    return OK


@inner
def restore(t, boom, work, p):
    """Put the boom back to rest."""
    for i in range(boom.z.shape[0]):
        boom.z[i] = p.rest[i]
    place(t, boom, work)


@inner
def note_linkages(t, p):
    """Write the joint angles of the rigid boom at the strokes of the drives, and their derivatives by stroke."""
    for i in range(p.angles.shape[0]):
        row = t.linkages[i]
        angle = angle_of_length(row, p.closed[i] + p.drives[i], p.angles[i], -WIDEST, WIDEST)
        if math.isfinite(angle):
            p.angles[i] = angle
        _, lever = cylinder_length(row, p.angles[i])
        _, beyond = cylinder_length(row, p.angles[i] + CURVATURE_STEP)
        _, before = cylinder_length(row, p.angles[i] - CURVATURE_STEP)
        p.slope[i] = 1.0 / lever
        p.curvature[i] = -(beyond - before) / (2.0 * CURVATURE_STEP) / (lever * lever * lever)


@inner
def respond_statically(t, boom, work, p):
    """Write the static columns: half the difference of the answers to a small load and to its opposite."""
    n, operations, loaded = p.drives.shape[0], t.operations.shape[0], t.clearances.shape[0] > 0
    for k in range(2 + n):
        for sign in (1.0, -1.0):
            motion = Motion(0.0, 0.0, p.position, p.still, loaded or (k == 0 and sign > 0.0))
            clear_cut(work, FREE)
            load_pins(t, boom, work, motion)
            for i in range(n):
                work.drive[i], work.drive_rate[i] = p.closed[i] + p.drives[i], 0.0
            if motion.renew and not loaded:
                sweep_in(t, boom, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE, work.condensed)
                motion = Motion(0.0, 0.0, p.position, p.still, False)
                clear_cut(work, FREE)
            if k < 2:
                work.p[k] = -sign * FORCE_SIZE
            else:
                work.drive[k - 2] += sign * DRIVE_SIZE
            sweep_in(t, boom, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE, work.condensed)
            sweep_out(t, boom, work, work.condensed, ROOT, operations, FREE)
            size = 2.0 * (FORCE_SIZE if k < 2 else DRIVE_SIZE)
            for i in range(boom.z.shape[0]):
                p.columns[k, i] = work.dz[i] / size if sign > 0.0 else p.columns[k, i] - work.dz[i] / size


@inner
def nudge_of(t, increments):
    """Return how many of these increments of the unknowns turn none of them by more than `NUDGE`."""
    largest = 1e-300
    for i in range(increments.shape[0]):
        largest = max(largest, t.scale[i] * abs(increments[i]))
    return NUDGE / largest


@inner
def change_readings(t, boom, work, p, k):
    """Write the derivative of the sensors' readings along column `k`, by central differences about rest."""
    size = nudge_of(t, p.columns[k])
    for side in range(2):
        for i in range(boom.z.shape[0]):
            boom.z[i] = p.rest[i] + (size - 2.0 * size * side) * p.columns[k, i]
        place(t, boom, work)
        read_sensors(t, boom, p, p.sides[side])
    for i in range(p.sides.shape[1]):
        p.readings[k, i] = (p.sides[0, i] - p.sides[1, i]) / (2.0 * size)
    restore(t, boom, work, p)


@inner
def read_sensors(t, boom, p, found):
    """Write what angle sensors read (n, rad; to the base if absolute), x, y (m) and angle of sites, angles of chords (n)."""
    n, sites = p.frames.shape[0], p.sites.shape[0]
    for i in range(n):
        root = p.roots[i]
        if p.absolute[i]:
            found[i] = boom.frames[p.frames[i], FRAME_ANGLE]
        else:
            found[i] = boom.frames[root, FRAME_ANGLE] - boom.frames[root - 1, FRAME_ANGLE]
    for k in range(sites):
        found[n + 3 * k], found[n + 3 * k + 1], found[n + 3 * k + 2] = locate(t, boom, p, k)
    for i in range(n):
        one, other = boom.frames[p.roots[i]], boom.frames[p.roots[i + 1]]
        x, y = other[FRAME_X] - one[FRAME_X], other[FRAME_Y] - one[FRAME_Y]
        # against the root's own angle, so that the difference of two is never near a whole turn
        c, s = one[FRAME_COS], one[FRAME_SIN]
        found[n + 3 * sites + i] = one[FRAME_ANGLE] + math.atan2(c * y - s * x, c * x + s * y)


@inner
def locate(t, boom, p, k):
    """Return x, y (m) and angle (rad) of site `k` of a boom whose frames are placed."""
    site = p.sites[k]
    frame, x, y, turn = boom.frames[site.frame], site.x, 0.0, 0.0
    if site.beam >= 0:
        x, y, turn = point_on_axis(t.beams[site.beam], t.psi[site.beam], boom.z, p.psi[k], p.weights[k])
    c, s = frame[FRAME_COS], frame[FRAME_SIN]
    return frame[FRAME_X] + c * x - s * y, frame[FRAME_Y] + s * x + c * y, frame[FRAME_ANGLE] + turn


@inner
def leave_modes_out(p):
    """Subtract the modes' share from the columns of the force."""
    n = p.drives.shape[0]
    for a in range(2):
        for j in range(p.modes[0]):
            at = 2 + n + j
            share = p.readings[at, n + a] / (p.omega[j] * p.omega[j])
            for i in range(p.columns.shape[1]):
                p.columns[a, i] -= share * p.columns[at, i]
            for i in range(p.readings.shape[1]):
                p.readings[a, i] -= share * p.readings[at, i]
            for i in range(n):
                p.forces[a, i] -= share * p.forces[at, i]
            for i in range(p.bending.shape[0]):
                p.moments[a, i] -= share * p.moments[at, i]


# -- modes ------------------------------------------------------------------------------------------------------------------


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
        sweep_out(t, boom, work, work.condensed, ROOT, t.operations.shape[0], FREE)
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
