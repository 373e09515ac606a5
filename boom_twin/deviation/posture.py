"""Linearisation of a boom about static equilibrium: small changes by drives, a force at the tip, and natural modes.

With the drives d, a force f at the tip and modal coordinates q (unit modal mass), the unknowns of the boom are

    z = z_0 + sum_i Z_i (d_i - d_0i) + sum_a R_a f_a + sum_j S_j q_j,
    q_j'' + c_j q_j' + omega_j^2 q_j = phi_j . f - sum_i N_ji / omega_j^2 d_i'',

Z_i and Z_a static responses to a unit of a drive and of the force, S_j mode shapes, phi_j their motion of the tip, N_ji their
forces in the cylinders, R_a = Z_a - sum_j phi_ja / omega_j^2 S_j the static response that the modes leave out. What sensors
read changes by the same columns. When the posture moves, modes follow it (`mode_tracking`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
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
from ..kernels.tables import BEAM, BODY, FRAME_ANGLE, FRAME_COS, FRAME_SIN, FRAME_X, FRAME_Y, JOINT_A, JOINT_B, OK, Motion
from ..kernels.transfer.clearance_pins import load_pins
from ..kernels.transfer.forward_kinematics import place
from ..kernels.transfer.riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out
from ..kernels.transfer.time_step import advance
from ..types import Array, StrokeReading
from .channels import TIP_IMU_STATES, Measurement
from .mode_tracking import iterate_modes, modal_loss, nudge_of, restore
from .sensor_model import Mounting, section_frames

FORCE_SIZE = 1.0  # N
DRIVE_SIZE = 1e-6  # m, loads that differences are taken over
WIDEST = math.pi  # rad, range in which a joint angle is looked for
CURVATURE_STEP = 1e-4  # rad


@by_reference
class Posture(NamedTuple):
    """Boom at rest and its first-order changes.

    n joints, m modes, u unknowns, h histories, c = 2 + n + m columns: force at the tip along x and y (the part that no mode
    has), the drives, the modes.
    """

    modes: NDArray[np.int64]  # (1,) how many
    drives: Array  # (n,) strokes of the drives at rest, m
    angles: Array  # (n,) of the rigid boom there, rad
    rest: Array  # (u,) unknowns at rest
    columns: Array  # (c, u) their changes
    motions: Array  # (m, h) of every mass point
    # (c, 2 n + 3 sites) changes of what angle sensors read (rad), of x, y, angle of every site, the tip first, and of the
    # angles of the sections' chords, from pivot to pivot
    readings: Array
    forces: Array  # (c, n) of the cylinders, N
    moments: Array  # (c, stations) of bending, N m
    read: Array  # (2 n + 3 sites,) what `readings` are changes of, at rest
    pulled: Array  # (n,) forces at rest, N
    omega: Array  # (m,) natural frequencies, rad/s
    decay: Array  # (m,) 2 zeta omega, 1/s
    compliance: Array  # (n,) 1/k, m/N; 0 if rigid
    lag: Array  # (n,) d/k, s
    oil_read: Array  # (n,) the compliance where stroke transducers read lengths, 0 where they read drives (`reads_drive`)
    # (n,) change of such a reading by its drive at a constant force N, m/m: 1 + N d(1/k)/dd, for a longer column of oil is
    # softer; 1 where drives are read
    drive_read: Array
    reads_drive: bool
    reads_angle: bool  # whether the model is driven by angles
    tilt: Array  # (n,) angle of the base, for inclinometers, rad
    gravity: Array  # (2,) m/s^2
    slope: Array  # (n,) change of a joint's angle by its stroke, rad/m
    curvature: Array  # (n,) change of that, rad/m^2
    frames: NDArray[np.int64]  # (n,) of angle sensors, as the next two, see `Mounting`
    absolute: NDArray[np.bool_]
    sways: NDArray[np.bool_]
    roots: NDArray[np.int64]  # (n + 1,) frames of the pivots and of the tip
    masses: Array  # (h,) kg, kg m^2
    points: NDArray[np.int64]  # (k, 2) mass points: place of x in h (y follows), section
    lengths: Array  # (n,) of the sections, m
    closed: Array  # (n,) closed lengths of the cylinders, m
    channels: np.recarray  # as the next six, see `boom_twin.deviation.channels.Measurement`
    sites: np.recarray
    errors: np.recarray
    psi: Array
    weights: Array
    bending: Array
    stroke_zero: int
    behind: NDArray[np.int64]  # (1,) states of sensors' errors that the estimate has beside those of the prediction
    delayed: NDArray[np.int64]  # (1,) copies of late readings behind these, see `boom_twin.deviation.delayed`
    # scratch; `rate` (n,) stays zero
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
    columns, (roots, heads) = 2 + n + most, section_frames(plan)
    return Posture(
        modes=np.zeros(1, np.int64), drives=np.full(n, np.inf), angles=np.zeros(n), rest=np.zeros(unknowns),
        columns=np.zeros((columns, unknowns)), motions=np.zeros((most, histories)), readings=np.zeros((columns, width)),
        forces=np.zeros((columns, n)), moments=np.zeros((columns, len(measured.bending))),
        read=np.zeros(width), pulled=np.zeros(n), omega=np.zeros(most),
        decay=np.zeros(most), compliance=np.zeros(n), lag=np.zeros(n),
        oil_read=np.zeros(n), drive_read=np.ones(n), reads_drive=reads is StrokeReading.DRIVE,
        reads_angle=reads is StrokeReading.ANGLE,
        tilt=np.where(mounting.absolute, inclination, 0.0), gravity=np.array(plan.tables.gravity), slope=np.zeros(n),
        curvature=np.zeros(n), frames=mounting.frames.astype(np.int64), absolute=mounting.absolute, sways=mounting.sways,
        roots=np.append(roots, heads[-1]).astype(np.int64), masses=plan.masses, points=np.array(list(_mass_points(plan))),
        lengths=lengths, closed=plan.closed_lengths, **measured._asdict(),
        behind=np.array([TIP_IMU_STATES + (3 if measured.stroke_zero else 2) * n]), delayed=np.zeros(1, np.int64),
        still=np.zeros(histories), position=np.zeros(histories), hat=np.zeros(histories),
        response=np.zeros((most, unknowns)), sides=np.zeros((2, width)),
        shifted=np.zeros((most, histories)), small=np.zeros((4, most, most)), target=np.zeros(n), rate=np.zeros(n),
    )  # fmt: skip


def _mass_points(plan: Plan) -> Iterator[tuple[int, int]]:
    """Yield the place of x and the section of every mass point; links and cylinders count to the section before their joint."""
    t, section = plan.tables, -1
    for kind, row in t.operations:
        found = list[int]()
        if kind == BEAM:
            found = [t.beams[row].history + 2 * k for k in range(t.beams[row].points)]
        elif kind == BODY:
            found = [t.bodies[row].history]
        elif kind in (JOINT_A, JOINT_B):
            joint, cylinder = t.joints[row], t.cylinders[section + 1]
            found = [each.history for each in t.links[joint.first_link : joint.first_link + joint.links]]
            found += [each.history for each in t.parts[cylinder.first_part : cylinder.first_part + cylinder.parts]]
        yield from ((int(place), section) for place in found if section >= 0)
        section += kind in (JOINT_A, JOINT_B)


@kernel
def settle_at(t, boom, work, p, drives):
    """Settle `boom` (State) at the strokes `drives` (n,) of the drives, starting from the rest before; return the status."""
    for i in range(drives.shape[0]):
        p.drives[i], p.target[i] = drives[i], p.closed[i] + drives[i]
    scheme = prepare(REST, 0.0, 0.0, work.weights)
    status, _, _ = advance(t, boom, work, scheme, p.target, p.rate, TOLERANCE, PASSES, LONGEST_INCREMENT, None, False)
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
        cylinder, drive = t.cylinders[i], p.closed[i] + drives[i]
        p.pulled[i] = boom.z[cylinder.z]
        p.compliance[i], p.lag[i] = compliance_and_lag(cylinder, t.oils, drive)
        if not p.reads_drive:
            longer, _ = compliance_and_lag(cylinder, t.oils, drive + DRIVE_SIZE)
            shorter, _ = compliance_and_lag(cylinder, t.oils, drive - DRIVE_SIZE)
            p.oil_read[i], p.drive_read[i] = p.compliance[i], 1.0 + p.pulled[i] * (longer - shorter) / (2.0 * DRIVE_SIZE)
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
                sweep_in(t, boom, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE)
                motion = Motion(0.0, 0.0, p.position, p.still, False)
                clear_cut(work, FREE)
            if k < 2:
                work.p[k] = -sign * FORCE_SIZE
            else:
                work.drive[k - 2] += sign * DRIVE_SIZE
            sweep_in(t, boom, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE)
            sweep_out(t, boom, work, ROOT, operations, FREE)
            size = 2.0 * (FORCE_SIZE if k < 2 else DRIVE_SIZE)
            for i in range(boom.z.shape[0]):
                p.columns[k, i] = work.dz[i] / size if sign > 0.0 else p.columns[k, i] - work.dz[i] / size


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
