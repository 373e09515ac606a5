"""Pins with clearance in the sweeps: offsets of journals at cylinders, pivots and links, condensed where the pin is.

The end of a cylinder stands off its pin by delta: R = R_pin + delta, C likewise. Its own system over (C, R, N) is written
for the ends; delta and the pin's force are condensed there, and what goes on is a system over the pins. Pivots and link pins
are unknowns of their joint (see `kernels.transfer.slider_crank`, `kernels.transfer.six_bar`).

The offset of a pin's journal moves all that hangs on it, as the head's pivot would. So its rows are those of the head's pivot
as far as they come from these parts, which are therefore assembled in turn: link L, link R, section i.
"""

from __future__ import annotations

import math

from ..elements.cylinder import AXIAL, END_C, END_R
from ..elements.pin_contact import (
    BARREL_END_PIN,
    CLOSED,
    HOLD_X,
    HOLD_Y,
    K_XX,
    K_XY,
    K_YY,
    LEAST_GAP,
    LINK_L_PIN,
    LINK_R_PIN,
    NEAR,
    PIVOT,
    Q_PIN,
    ROD_END_PIN,
    SPRING,
    TORQUE,
    TORQUE_TURN,
    TORQUE_X,
    TORQUE_Y,
    Journal,
    limited,
    pin_force,
    remember,
)
from ..integrators import A, V
from ..jit import inner
from ..tables import (
    HEAD_TURN,
    LINK_L_TURN,
    SECTION_TURN,
    Z_FORCE_B,
    Z_LAMBDA,
    Z_LINK_L,
    Z_LINK_R,
    Z_OFFSETS_B,
)

ALLOWED = 1e-3  # of the clearance, or of the least one in K: error of a sub-step in an offset


@inner
def offset_of(t, z, owner, place):
    """Offset (m) of the journal in the pin `place` of a joint or cylinder; zero for an ideal pin."""
    for k in range(owner.first_clearance, owner.first_clearance + owner.clearances):
        row = t.clearances[k]
        if row.place == place:
            return z[row.z], z[row.z + 1]
    return 0.0, 0.0


@inner
def set_turn(t, work, owner, place, angle):
    """Note the journal's angle in the bush (rad) of the pin `place`, if it has friction."""
    for k in range(owner.first_clearance, owner.first_clearance + owner.clearances):
        row = t.clearances[k]
        if row.place == place and row.friction > 0.0:
            work.position[row.turn] = angle


@inner
def force_of_pin(t, state, k, position, rate, offset):
    """Return the `PinForce` of pin `k`, whose velocities are v = rate x + offset; `position` has the angles of journals."""
    row, before = t.clearances[k], state.history[V]
    x, y, turning = state.z[row.z], state.z[row.z + 1], 0.0
    vx, vy = rate * x + offset[row.z], rate * y + offset[row.z + 1]
    if row.friction > 0.0:
        turning = rate * position[row.turn] + offset[row.turn]
    ax, ay = axis_of(t, state, row)
    journal = Journal(
        x=x, y=y, vx=vx, vy=vy, before_x=before[row.z], before_y=before[row.z + 1], turning=turning, axis_x=ax, axis_y=ay
    )
    return pin_force(row, state.contacts[k], journal, rate)


@inner
def load_pins(t, state, work, motion):
    """Force, tangent and torque of every pin with clearance into `work.hold`."""
    for k in range(t.clearances.shape[0]):
        hold, found = work.hold[k], force_of_pin(t, state, k, work.position, motion.rate, motion.offset)
        hold[HOLD_X], hold[HOLD_Y], hold[K_XX], hold[K_XY], hold[K_YY] = found.x, found.y, found.xx, found.xy, found.yy
        hold[TORQUE], hold[TORQUE_X], hold[TORQUE_Y] = found.torque, found.torque_x, found.torque_y
        hold[TORQUE_TURN] = found.torque_turn


@inner
def axis_of(t, state, row):
    """First axis of what a linearised pin is fixed to: the cylinder, or the body with the bush."""
    turns = state.turns[row.owner]
    if row.place >= ROD_END_PIN:
        pins = state.pins[row.owner]
        dx, dy = pins[END_R] - pins[END_C], pins[END_R + 1] - pins[END_C + 1]
        length = math.hypot(dx, dy)
        return dx / length, dy / length
    if row.place == LINK_R_PIN:
        return turns[SECTION_TURN], turns[SECTION_TURN + 1]
    if row.place == Q_PIN:
        return turns[LINK_L_TURN], turns[LINK_L_TURN + 1]
    return turns[HEAD_TURN], turns[HEAD_TURN + 1]


@inner
def add_turning(hold, h, at, journal, bush):
    """Tangent of friction's torque between two bodies, whose angles stand at `journal` and `bush`, the offset at `at`."""
    low, high = min(journal, bush), max(journal, bush)
    h[journal, journal] += hold[TORQUE_TURN]
    h[bush, bush] += hold[TORQUE_TURN]
    h[high, low] -= hold[TORQUE_TURN]
    for i in range(2):
        h[at + i, journal] += hold[TORQUE_X + i]
        h[at + i, bush] -= hold[TORQUE_X + i]


@inner
def torque_of(t, work, owner, place):
    """Torque (N m) with which friction holds the journal of the pin `place`; zero without."""
    for k in range(owner.first_clearance, owner.first_clearance + owner.clearances):
        if t.clearances[k].place == place:
            return work.hold[k, TORQUE]
    return 0.0


@inner
def end_of(row):
    """First place of an end's coordinates among (C, R, N)."""
    return END_C if row.place == BARREL_END_PIN else END_R


@inner
def condense_ends(t, state, work, cylinder, g, h):
    """Give the ends of a cylinder that have clearance offsets of their own, and condense them from (g, h).

    (g, h) is written for the ends y = (C, R, N), and an end is its pin plus delta. So what `g` and `h` say of that end e holds
    for delta too, to which the pin adds its force f and tangent K:

        (H_ee + K) ddelta + H_ey dy + g_e + f = 0,    y now with the pin in place of the end.

    Hence ddelta = -free - gains dy, free = (H_ee + K)^-1 (g_e + f), gains = (H_ee + K)^-1 H_ey, and what is left for y is
    g - H_ye free and H - H_ye gains, as in `six_bar`. A second end is condensed from what the first one left, where the first
    is a pin and the second still an end; `move_ends` therefore goes back from the last to the first.
    """
    torque = 0.0
    for k in range(cylinder.first_clearance, cylinder.first_clearance + cylinder.clearances):
        torque += work.hold[k, TORQUE]
    if torque != 0.0:
        _turn_back(g, h, torque / work.position[cylinder.history])
    for k in range(cylinder.first_clearance, cylinder.first_clearance + cylinder.clearances):
        at, hold, block = end_of(t.clearances[k]), work.hold[k], work.condensed.ends[k]
        gains, free = work.condensed.end_gains[k], work.condensed.end_free[k]
        block[0, 0], block[0, 1] = h[at, at] + hold[K_XX], h[at, at + 1] + hold[K_XY]
        block[1, 0], block[1, 1] = block[0, 1], h[at + 1, at + 1] + hold[K_YY]
        share = 1.0 / (block[0, 0] * block[1, 1] - block[0, 1] * block[0, 1])
        xx, xy, yy = share * block[1, 1], -share * block[0, 1], share * block[0, 0]
        gx, gy = g[at] + hold[HOLD_X], g[at + 1] + hold[HOLD_Y]
        free[0], free[1] = xx * gx + xy * gy, xy * gx + yy * gy
        for j in range(5):
            gains[0, j], gains[1, j] = xx * h[at, j] + xy * h[at + 1, j], xy * h[at, j] + yy * h[at + 1, j]
        for i in range(5):
            to_x, to_y = h[i, at], h[i, at + 1]
            g[i] -= to_x * free[0] + to_y * free[1]
            for j in range(5):
                h[i, j] -= to_x * gains[0, j] + to_y * gains[1, j]


@inner
def _turn_back(g, h, force):
    """Friction's torque on a cylinder, as a couple of forces (N) on its ends, `force` = torque over length.

    The torque M works on the cylinder's angle gamma. With e the axis, n = (-e_y, e_x) and d = R - C of length l,
    dgamma = n.(dR - dC)/l, so the gradient by R is M/l n, and by C its opposite. The axis is read from the row of the
    cylinder's law: its derivative by R is e over a positive number, which the norm takes out. Its tangent is left out.
    """
    along_x, along_y = h[AXIAL, END_R].real, h[AXIAL, END_R + 1].real  # real by itself also in a frequency response
    share = force / math.hypot(along_x, along_y)
    ex, ey = share * along_x, share * along_y
    g[END_C] += ey
    g[END_C + 1] -= ex
    g[END_R] -= ey
    g[END_R + 1] += ex


@inner
def move_ends(t, work, cylinder, cx, cy, rx, ry, force):
    """Increments of the offsets of a cylinder's ends from those of its pins C and R and of its force."""
    for k in range(cylinder.first_clearance + cylinder.clearances - 1, cylinder.first_clearance - 1, -1):
        row, gains, free = t.clearances[k], work.condensed.end_gains[k], work.condensed.end_free[k]
        dx = -free[0] - gains[0, 0] * cx - gains[0, 1] * cy - gains[0, 2] * rx - gains[0, 3] * ry - gains[0, 4] * force
        dy = -free[1] - gains[1, 0] * cx - gains[1, 1] * cy - gains[1, 2] * rx - gains[1, 3] * ry - gains[1, 4] * force
        work.dz[row.z], work.dz[row.z + 1] = dx, dy
        if row.place == BARREL_END_PIN:
            cx, cy = cx + dx, cy + dy
        else:
            rx, ry = rx + dx, ry + dy


@inner
def shorten(t, state, work):
    """Limit the increments of all offsets, see `kernels.elements.pin_contact.limited`."""
    for k in range(t.clearances.shape[0]):
        row = t.clearances[k]
        i, j = row.z, row.z + 1
        if state.contacts[k, SPRING] == 0.0:
            work.dz[i], work.dz[j] = limited(row, state.z[i], state.z[j], work.dz[i], work.dz[j])


@inner
def note_contacts(t, state, work):
    """Let all pins remember the step that ends; before the histories are written."""
    before = state.history[V]
    for k in range(t.clearances.shape[0]):
        row, hold = t.clearances[k], work.hold[k]
        x, y = state.z[row.z], state.z[row.z + 1]
        remember(row, state.contacts[k], x, y, before[row.z], before[row.z + 1], hold[HOLD_X], hold[HOLD_Y])


@inner
def coarseness(t, state, work, scheme):
    """Largest error of a sub-step in the offset of a pin that touches, over what is allowed.

    (1/A - h^2/6) (a' - a) (Zienkiewicz and Xie 1991, with 1/A = beta h^2 for Newmark's family), against `ALLOWED` of the
    clearance. Stiff contact leaves of it what the journal's inertia M A is to the whole tangent, (M A + K)^-1 M A (Hairer and
    Wanner, Solving Ordinary Differential Equations II, 1996, eq. IV.8.19). A journal without inertia has no motion of its own.
    """
    worst, before = 0.0, state.history[A]
    if scheme.gain == 0.0:
        return worst
    size = abs(1.0 / scheme.gain - (1.0 / 6.0) * scheme.reach * scheme.reach)
    for k in range(t.clearances.shape[0]):
        row, memory = t.clearances[k], state.contacts[k]
        i, j = row.z, row.z + 1
        if row.heavy == 0 or memory[SPRING] > 0.0:
            continue
        touching = math.hypot(state.z[i], state.z[j]) > row.gap - NEAR
        if touching or memory[CLOSED] > 0.0:
            ax = scheme.gain * (state.z[i] - work.hat[i]) - before[i]
            ay = scheme.gain * (state.z[j] - work.hat[j]) - before[j]
            ax, ay = unstiffened(t, work, k, ax, ay)
            worst = max(worst, size * math.hypot(ax, ay) / (ALLOWED * max(row.gap, LEAST_GAP)))
    return worst


@inner
def unstiffened(t, work, k, ax, ay):
    """Return (M A + K)^-1 M A times (ax, ay), with the tangents of a pass for pin `k`: M A + K is what was condensed there."""
    row, hold = t.clearances[k], work.hold[k]
    if row.place >= ROD_END_PIN:
        xx, xy, yy = work.condensed.ends[k, 0, 0], work.condensed.ends[k, 0, 1], work.condensed.ends[k, 1, 1]
    else:
        block, at = work.condensed.blocks[row.owner], row.z - t.joints[row.owner].z
        xx, xy, yy = block[at, at], block[at + 1, at], block[at + 1, at + 1]
    fx = (xx - hold[K_XX]) * ax + (xy - hold[K_XY]) * ay
    fy = (xy - hold[K_XY]) * ax + (yy - hold[K_YY]) * ay
    share = 1.0 / (xx * yy - xy * xy)
    return share * (yy * fx - xy * fy), share * (xx * fy - xy * fx)


# places in the loop's system: pivot x, y; turn of the head; pin C x, y | section, links, lambda, N
HEAD, PIN_C, SECTION = 2, 3, 5  # from SECTION on in the order of the joint's unknowns
ALPHA_L, ALPHA_R, LAMBDA = SECTION + Z_LINK_L, SECTION + Z_LINK_R, SECTION + Z_LAMBDA
FORCE, SIZE = SECTION + Z_FORCE_B, SECTION + Z_OFFSETS_B


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
            g[at + i] += g[i] - apart[i, size] + hold[HOLD_X + i]
            for j in range(size):
                value = h[max(i, j), min(i, j)] - apart[i, j]
                if j < at:
                    h[at + i, j] += value
                elif j > at + 1:
                    h[j, at + i] += value
            for j in range(i + 1):
                h[at + i, at + j] += h[i, j] - apart[i, j] + hold[K_XX + i + j]


@inner
def free_pins(t, state, work, joint, g, h):
    """Closure of pin Q with all offsets, the force of pin Q's own, and friction in all four pins."""
    lx, ly = state.z[joint.z + Z_LAMBDA], state.z[joint.z + Z_LAMBDA + 1]
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
                g[at + i] += hold[HOLD_X + i]
                for j in range(i + 1):
                    h[at + i, at + j] += hold[K_XX + i + j]
        journal = SECTION if place == PIVOT else ALPHA_L if place == LINK_L_PIN else ALPHA_R
        bush = SECTION if place == LINK_R_PIN else ALPHA_L if place == Q_PIN else HEAD
        g[journal] += hold[TORQUE]
        g[bush] -= hold[TORQUE]
        add_turning(hold, h, at, journal, bush)
