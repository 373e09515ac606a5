"""Time step of the boom: Newton passes of one step, many steps in one call."""

from __future__ import annotations

import math

from ..elements.pin_contact import CLOSED
from ..integrators import GENERALISED_ALPHA, NEWMARK, A, V, X, finish_step, prepare, start_step
from ..jit import inner, kernel
from ..result_row import results_in
from ..tables import FRAME_ANGLE, JOINT_A, JOINT_B, NOT_CONVERGED, NOT_FINITE, OK, Z_SECTION, Motion
from .clearance_pins import coarseness, force_of_pin, load_pins, note_contacts, shorten
from .forward_kinematics import place
from .kept_tangent import (
    correct_guess,
    forget_all,
    forget_tangent,
    is_converged,
    keep_tangent,
    may_keep,
    note_correction,
)
from .matrix_product import plain_pass
from .riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out

TICKS = 4096  # ticks of a step; sub-steps are whole numbers of ticks
MOST = 32  # largest number of sub-steps for accuracy; after failed passes they are divided down to SHORTEST
SHORTEST = 1e-5  # s, shortest sub-step
LONGEST_INCREMENT = 0.5  # rad, limit of the increments in one pass of a time step; larger ones mean divergence


@kernel
def advance(t, state, work, scheme, drive, drive_rate, tolerance, passes, longest, product, keep):
    """Step the boom to drive lengths (m) and rates (m/s), both (n,), at the instant that `scheme` solves for.

    Newton passes on exact kinematics: place, sweep in, sweep out, until the increments are small. Where journals with
    clearance hit their bushes the step is divided, so that impacts are resolved. `REST` as scheme gives static equilibrium
    near the positions of the history.

    `tolerance` is the largest increment (rad) at convergence, which is quadratic: the remaining error is about its square.
    `passes` is their largest number; a single pass is the papers' linearised step and counts as converged. Increments of a
    pass are scaled down to `longest` (rad). `product`, of `kernels.transfer.matrix_product`, replaces the Riccati form unless
    it is None. `keep`, for ideal pins and the Riccati form: this step continues the last one in `work` and may use its
    tangent, see `kept_tangent`.

    Return status, passes, and last increment (rad). After a failure the histories are those of the last complete sub-step.
    """
    history, operations, done, total, size = state.history, t.operations.shape[0], 0, 0, 0.0
    part, least = first_part(t, state, scheme), least_part(t, scheme)
    coarse = max(least, TICKS // MOST)
    now = scheme
    while done < TICKS:
        if part < TICKS:
            now = prepare(scheme.family, scheme.parameter, scheme.reach * part / TICKS, work.finer)
        share = (done + part) / TICKS
        interpolate_drive(state, work, drive, drive_rate, scheme.reach, share)
        fx = work.load[0, 0] + share * (work.load[1, 0] - work.load[0, 0])
        fy = work.load[0, 1] + share * (work.load[1, 1] - work.load[0, 1])
        start_step(now, history, work.hat, work.offset)
        predict(t, state, now.reach)
        if keep:
            correct_guess(state, work)
        status, left, before = NOT_CONVERGED, passes, 0.0
        place(t, state, work)
        while status == NOT_CONVERGED and left > 0:
            renew = not keep or not may_keep(work, now.gain)
            if renew and keep:
                keep_tangent(state, work, now.gain)
            motion = Motion(now.gain, now.rate, work.hat, work.offset, renew)
            load_pins(t, state, work, motion)
            if product is None:
                clear_cut(work, FREE)
                work.p[0] -= fx
                work.p[1] -= fy
                solved, _, _ = sweep_in(t, state, work, motion, work.drive, work.drive_rate, ROOT, operations, FREE)
                if solved == OK:
                    sweep_out(t, state, work, ROOT, operations, FREE)
            else:
                solved = plain_pass(t, state, work, motion, work.drive, work.drive_rate, product)
            if solved == OK:
                shorten(t, state, work)
                size = add_increments(t, state, work, longest)
                place(t, state, work)
            left -= 1
            if keep:
                status = newton_status(work, solved, size, 0.0, 0)
                if status == NOT_CONVERGED and is_converged(t, state, work, size, before, renew, tolerance, now.gain):
                    status = OK
                before = size
            else:
                status = newton_status(work, solved, size, tolerance, passes)
        if keep:
            note_correction(state, work)
            if left < passes - 1:
                forget_tangent(work)
        total += passes - left
        error = coarseness(t, state, work, now)
        if (status != OK and part > least) or (error > 1.0 and part > coarse):
            part //= 2
            for i in range(state.z.shape[0]):
                state.z[i] = history[X, i]
            continue
        if status != OK:
            return status, total, size
        note_contacts(t, state, work)
        finish_step(now, work.position, work.hat, work.offset, work.velocity, work.acceleration, history)
        done += part
        if error < 0.1 and part < TICKS and done % (2 * part) == 0:
            part *= 2
    state.pace[0] = part
    for i in range(drive.shape[0]):
        state.drives[0, i], state.drives[1, i] = drive[i], drive_rate[i]
    return OK, total, size


@inner
def advance_again(t, state, work, scheme, drive, drive_rate, tolerance, passes, longest, product, keep):
    """Advance like `advance`. If a step fails with a kept tangent, repeat it with new ones. Return status and passes."""
    total, may_use = 0, keep
    while True:
        status, count, _ = advance(t, state, work, scheme, drive, drive_rate, tolerance, passes, longest, product, may_use)
        total += count
        if status == OK or not may_use:
            return status, total
        forget_all(work)
        may_use = False


@inner
def first_part(t, state, scheme):
    """Return the ticks of the first sub-step: those at the end of the last step, or all at the start."""
    if t.clearances.shape[0] == 0 or least_part(t, scheme) == TICKS or state.pace[0] == 0:
        return TICKS
    return max(state.pace[0], least_part(t, scheme), TICKS // MOST)


@inner
def least_part(t, scheme):
    """Return the ticks of the shortest sub-step: all without clearance or outside generalised-alpha and Newmark."""
    part = TICKS
    if t.clearances.shape[0] > 0 and (scheme.family == GENERALISED_ALPHA or scheme.family == NEWMARK):
        while part > 1 and scheme.reach * part > 2.0 * SHORTEST * TICKS:
            part //= 2
    return part


@inner
def interpolate_drive(state, work, drive, drive_rate, span, share):
    """Write the drive at `share` of a step of `span` s, on the cubic from the last step's drive to this one's."""
    u = share
    for i in range(drive.shape[0]):
        work.drive[i], work.drive_rate[i] = drive[i], drive_rate[i]
        if u < 1.0:
            start, v = state.drives[0, i], state.drives[1, i] * span
            gap, end = drive[i] - start - v, drive_rate[i] * span - v
            c2, c3 = 3.0 * gap - end, end - 2.0 * gap
            work.drive[i] = start + u * (v + u * (c2 + u * c3))
            work.drive_rate[i] = (v + u * (2.0 * c2 + u * 3.0 * c3)) / span


@inner
def predict(t, state, reach):
    """Write the first guess of the unknowns `reach` s ahead: x + h v + h^2 a/2 for coordinates, unchanged forces."""
    x, v, a = state.history[X], state.history[V], state.history[A]
    for i in range(state.z.shape[0]):
        if t.moving[i] > 0.0:
            state.z[i] = x[i] + reach * (v[i] + 0.5 * reach * a[i])


@inner
def newton_status(work, solved, size, tolerance, passes):
    """Return the status after a pass with result `solved` and increment `size` (rad); NOT_CONVERGED: continue."""
    if solved != OK:
        for i in range(3):
            if not math.isfinite(work.p[i]):
                return NOT_FINITE
        return solved
    if not math.isfinite(size):
        return NOT_FINITE
    return OK if size < tolerance or passes == 1 else NOT_CONVERGED


@inner
def add_increments(t, state, work, longest):
    """Add increments to the unknowns, unless one of them is not finite; return the largest as an angle (rad), or NaN."""
    z, dz, size = state.z, work.dz, 0.0
    for i in range(z.shape[0]):
        if not math.isfinite(dz[i]):
            return math.nan
        size = max(size, t.scale[i] * abs(dz[i]))
    share = longest / size if size > longest else 1.0
    for i in range(z.shape[0]):
        z[i] += share * dz[i]
    return size


@kernel
def observe(t, state, out):
    """Write the instant in `state` into a row, shape (row_width or more,); see `kernels.result_row.Results`."""
    n, at = t.joints.shape[0], 0
    found = results_in(out, n, t.clearances.shape[0])
    for k in range(t.operations.shape[0]):
        row = t.operations[k].row
        if t.operations[k].kind == JOINT_A or t.operations[k].kind == JOINT_B:
            found.joints[at] = state.z[t.joints[row].z + Z_SECTION] - state.frames[k, FRAME_ANGLE]
            at += 1
    for i in range(n):
        cylinder = t.cylinders[i]
        found.cylinder_forces[i] = state.z[cylinder.z]
        found.lengths[i] = state.history[X, cylinder.history] - cylinder.closed_length
    for j in range(3):
        found.tip[0, j], found.tip[1, j] = state.history[X, t.tip + j], state.history[V, t.tip + j]
        found.tip[2, j] = state.history[A, t.tip + j]
    for k in range(t.clearances.shape[0]):
        at, hold = t.clearances[k].z, force_of_pin(t, state, k, state.history[X], 0.0, state.history[V])
        found.pins[k, 0], found.pins[k, 1] = state.z[at], state.z[at + 1]
        found.pins[k, 2], found.pins[k, 3] = math.hypot(hold.x, hold.y), state.contacts[k, CLOSED]


@kernel
def run(t, state, work, steps, counts, drives, rates, loads, family, parameter, tolerance, passes, product, out):
    """Step the boom along given drives, and write rows of results `out`, shape (rows, row_width), see `observe`.

    To each row lead `counts` (rows,) steps of `steps` (rows,) s. `drives` (m) and `rates` (m/s) have a row (n,) for the
    instant that each step solves for, `loads` one for the force at the tip (N) at its end; no rows, no force. Before the
    first step the force is ``work.load[1]``. For `family` and `parameter` see `kernels.integrators.prepare`, for the rest
    `advance`.

    Return status of the last step, the row it belongs to, total of Newton passes, `jolt` and `shake`: sums over all steps of
    h^2 |a' - a| and of h^2 |a'| of the tip, m. The first measures the step error, see `Simulation`. The second is half of the
    first if the acceleration changes sign in every step.
    """
    at, total, jolt, shake, a = 0, 0, 0.0, 0.0, state.history[A]
    keep = product is None and passes > 1 and t.clearances.shape[0] == 0
    forget_all(work)
    for row in range(steps.shape[0]):
        if row == 0 or steps[row] != steps[row - 1]:
            scheme = prepare(family, parameter, steps[row], work.weights)
        for _ in range(counts[row]):
            ax, ay = a[t.tip], a[t.tip + 1]
            if loads.shape[0] > 0:
                for i in range(2):
                    work.load[0, i], work.load[1, i] = work.load[1, i], loads[at, i]
            status, count = advance_again(
                t, state, work, scheme, drives[at], rates[at], tolerance, passes, LONGEST_INCREMENT, product, keep
            )
            total += count
            at += 1
            if status != OK:
                return status, row, total, jolt, shake
            jolt += steps[row] * steps[row] * math.hypot(a[t.tip] - ax, a[t.tip + 1] - ay)
            shake += steps[row] * steps[row] * math.hypot(a[t.tip], a[t.tip + 1])
        observe(t, state, out[row])
    return OK, steps.shape[0], total, jolt, shake
