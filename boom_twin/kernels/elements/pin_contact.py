"""Force between a journal and its bush with clearance, as contact or as its linearisation.

The journal's centre is offset from the bush's by delta = (x, y). With r = sqrt(|delta|^2 + s^2), n = delta/r, s = `SMOOTH`,

    gap g = r - c,    penetration d = [g + sqrt(g^2 + s^2)]/2,    g' = n.delta',
    F = K d^e [1 + chi g'/v],        K = 4/[3 (s_i + s_j)] sqrt(R_i R_j/(R_j - R_i)),

with radial clearance c, speed of approach v at the start of contact, s_i = (1 - nu^2)/E of each body, and radii R_i and
R_j = R_i + c. K diverges as c vanishes, although the pin becomes ideal. So K uses at least `LEAST_GAP` for R_j - R_i.
K and the form of F are those of Lankarani and Nikravesh 1990, used in [R] of `boom_twin.kernels`. The laws differ in
chi, a function of the coefficient of restitution. The bracket is at least `LEAST_SHARE`. So contact never pulls, and the
position of a massless journal stays determined when it leaves. With g' in the bracket the rebound does not depend on the
smoothing of d. The elastic energy is convex in delta, so a pin at rest has one position.

Friction opposes the surfaces' slip velocity w = n x delta' + R_i (angular velocity of the journal in the bush). It is
mu F w/sqrt(w^2 + w_s^2). F is that of the step before, which keeps the tangent symmetric.

The linearised pin at preload F_0 with penetration d_0 is a spring k = e F_0/d_0 and a damper chi F_0/v. Force F_0 stretches
the spring from its seat to c + d_0. The seat is fixed to the cylinder, or to the body with the bush of a pivot or link pin. It
therefore turns with the cylinder's force, and stays on its side if the force reverses.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..jit import inner

SMOOTH = 1e-6  # m, smoothing length of the onset of contact
NEAR = 4.0 * SMOOTH  # m, gap below which journal and bush count as touching
LEAST_GAP = 3e-5  # m, least difference of radii in K
LEAST_SHARE = 0.01  # least contact force as a fraction of the elastic force
SLOWEST = 1e-3  # m/s, least speed of approach
SLIP = 1e-3  # m/s, slip at which friction has 0.7 of its full size

PIVOT, LINK_L_PIN, LINK_R_PIN, Q_PIN, ROD_END_PIN, BARREL_END_PIN = range(6)  # kinds of pins


class Journal(NamedTuple):
    """Position and velocity of a journal in its bush."""

    x: float  # offset, m
    y: float
    vx: float  # velocity, m/s
    vy: float
    before_x: float  # velocity at the start of the step, m/s
    before_y: float
    turning: float  # angular velocity of the journal in the bush, rad/s
    axis_x: float  # first axis of the body with the seat
    axis_y: float


class PinForce(NamedTuple):
    """Contact force and friction torque on a journal, and their derivatives."""

    x: float  # force, N
    y: float
    xx: float  # tangent by the offset, N/m, as the next two
    xy: float
    yy: float
    torque: float  # of friction, N m
    torque_x: float  # derivatives of the torque by offset, N
    torque_y: float
    torque_turn: float  # by angle, N m


# Columns of `Work.hold`, a `PinForce` for every pin.
HOLD_X, HOLD_Y, K_XX, K_XY, K_YY, TORQUE, TORQUE_X, TORQUE_Y, TORQUE_TURN, HOLD_COLUMNS = range(10)

CLEARANCE = np.dtype(
    [
        ("z", np.int64),  # index of delta in the unknowns
        ("owner", np.int64),  # row of its joint and cylinder
        ("place", np.int64),  # kind of pin, `PIVOT` to `BARREL_END_PIN`
        ("turn", np.int64),  # index of the journal's angle in the histories, with friction only
        ("heavy", np.int64),  # 1 if the journal has inertia of its own
        ("linear", np.int64),  # 1: linearised at the preload of the first equilibrium
        ("gap", float),  # radial clearance c, m
        ("stiffness", float),  # K, N/m^e
        ("exponent", float),  # e
        ("loss", float),  # chi
        ("friction", float),  # mu
        ("radius", float),  # R_i, m
    ]
)

# Memory of a pin: touches (1) or not (0), speed of approach (m/s), normal force (N). Linearisation: spring (N/m; 0 for
# contact), damper (N s/m), seat (m, in the axes of its body). Number of lost contacts.
CLOSED, APPROACH, FORCE, SPRING, DAMPER, SEAT_X, SEAT_Y, LOST, COLUMNS = range(9)


def hunt_crossley_exact(restitution: float) -> float:
    """Return the chi for which Hunt and Crossley's force gives exactly this restitution, by `restitution_of`."""
    wanted, low, high = max(restitution, 0.01), 0.0, 1.0  # below it chi grows without bound
    while restitution_of(high) > wanted:
        low, high = high, 2.0 * high
    return bisect(lambda chi: restitution_of(chi) > wanted, low, high)


LAWS: dict[str, Callable[[float], float]] = {
    "hertz": lambda e: 0.0,  # lossless elastic contact (Hertz 1882)
    "lankarani-nikravesh": lambda e: 0.75 * (1.0 - e**2),  # nearly elastic contact (Lankarani and Nikravesh 1990)
    "flores": lambda e: 1.6 * (1.0 - e) / e,  # elastic to plastic contact (Flores, Machado, Silva and Martins 2011)
    "hunt-crossley": lambda e: 1.5 * (1.0 - e),  # hard contact at low speed (Hunt and Crossley 1975)
    "hunt-crossley-exact": hunt_crossley_exact,
}
"""chi by law, a function of the coefficient of restitution e."""


def restitution_of(loss: float) -> float:
    """Return the exact restitution of an impact with chi = `loss`. It is independent of speed, mass, K and exponent.

    Let u be the speed relative to that of approach. Over an impact m v^2 u du = -K d^e (1 + chi u) dd integrates to
    G(-e) = G(1). G(u) integrates s/max(1 + chi s, `LEAST_SHARE`) from 0 to u (Gonthier, McPhee, Lange and Piedboeuf 2004).
    """
    entering = _impact(loss, 1.0)
    return bisect(lambda e: _impact(loss, -e) < entering, 0.0, 1.0)


def _impact(chi: float, u: float) -> float:
    """Return G(u) of `restitution_of`."""
    free = (1.0 - LEAST_SHARE) / chi if chi > 0.0 else math.inf
    within, beyond = max(u, -free), max(-u - free, 0.0)
    if chi < 1e-3:
        found = within**2 * (0.5 - chi * within / 3.0 + (chi * within) ** 2 / 4.0)
    else:
        found = within / chi - math.log1p(chi * within) / chi**2
    return found + beyond * (free + 0.5 * beyond) / LEAST_SHARE if beyond > 0.0 else found


def bisect(is_below: Callable[[float], bool], low: float, high: float) -> float:
    """Return the value between `low` and `high` where `is_below` changes from True to False."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_below(middle) else (low, middle)
    return 0.5 * (low + high)


def contact_stiffness(radius: float, gap: float, softness: float) -> float:
    """Return K (N/m^1.5) of a pin of `radius` (m) with radial clearance `gap` (m); softness = s_i + s_j (1/Pa)."""
    apart = max(gap, LEAST_GAP)
    return 4.0 / (3.0 * softness) * math.sqrt(radius * (radius + apart) / apart)


@inner
def penetration(row, x, y):
    """Return direction n, distance r, penetration d and dd/dg of a journal at (x, y)."""
    r = math.sqrt(x * x + y * y + SMOOTH * SMOOTH)
    gap = r - row.gap
    root = math.sqrt(gap * gap + SMOOTH * SMOOTH)
    d = 0.5 * (gap + root) if gap > 0.0 else 0.5 * SMOOTH * SMOOTH / (root - gap)
    return x / r, y / r, r, d, d / root


@inner
def approach(memory, nx, ny, vx, vy):
    """Return the speed of approach (m/s): the stored one in contact, else that of velocity (vx, vy)."""
    if memory[CLOSED] > 0.0:
        return memory[APPROACH]
    return max(SLOWEST, nx * vx + ny * vy)


@inner
def pin_force(row, memory, journal, rate):
    """Return the `PinForce` of pin `row` on a `Journal`; `rate` is the integrator's C = dv/dx."""
    x, y, vx, vy = journal.x, journal.y, journal.vx, journal.vy
    if memory[SPRING] > 0.0:
        k, c, ax, ay = memory[SPRING], memory[DAMPER], journal.axis_x, journal.axis_y
        fx = k * (x - ax * memory[SEAT_X] + ay * memory[SEAT_Y]) + c * vx
        fy = k * (y - ay * memory[SEAT_X] - ax * memory[SEAT_Y]) + c * vy
        stiff = k + rate * c
        return PinForce(x=fx, y=fy, xx=stiff, xy=0.0, yy=stiff, torque=0.0, torque_x=0.0, torque_y=0.0, torque_turn=0.0)
    nx, ny, r, d, slope = penetration(row, x, y)
    speed = approach(memory, nx, ny, journal.before_x, journal.before_y)
    elastic = row.stiffness * (d * math.sqrt(d) if row.exponent == 1.5 else d**row.exponent)
    lead = row.loss / speed
    share = 1.0 + lead * (nx * vx + ny * vy)
    if share < LEAST_SHARE:
        share, lead = LEAST_SHARE, 0.0
    force = elastic * share
    radial = row.exponent * elastic / d * slope * share + elastic * lead * rate
    across = force / r
    drag, drag_rate = 0.0, 0.0
    if row.friction > 0.0:
        slip = nx * vy - ny * vx + row.radius * journal.turning
        width = math.sqrt(slip * slip + SLIP * SLIP)
        most = row.friction * memory[FORCE]
        drag, drag_rate = most * slip / width, 0.5 * most / width * (1.0 + (SLIP / width) ** 2) * rate
    along, rest, turn = across + drag_rate, across * (1.0 - nx * nx - ny * ny), row.radius * drag_rate
    kxx = radial * nx * nx + along * ny * ny + rest
    kyy = radial * ny * ny + along * nx * nx + rest
    kxy = (radial - along) * nx * ny
    return PinForce(
        x=force * nx - drag * ny, y=force * ny + drag * nx, xx=kxx, xy=kxy, yy=kyy,
        torque=row.radius * drag, torque_x=-turn * ny, torque_y=turn * nx, torque_turn=row.radius * turn,
    )  # fmt: skip


@inner
def limited(row, x, y, dx, dy):
    """Return the increments of delta, limited so that the penetration roughly doubles at most in a Newton pass.

    A pass that starts inside the gap does not see contact, so its increment may be far too large.
    """
    _, _, _, d, _ = penetration(row, x, y)
    far = math.sqrt((x + dx) * (x + dx) + (y + dy) * (y + dy))
    most = row.gap + 2.0 * d + 5.0 * SMOOTH
    if far <= most:
        return dx, dy
    share = most / far
    return share * (x + dx) - x, share * (y + dy) - y


@inner
def remember(row, memory, x, y, before_x, before_y, fx, fy):
    """Store the start or end of contact in an accepted step, and the normal force."""
    nx, ny, r, _, _ = penetration(row, x, y)
    closed = r - row.gap > -NEAR
    if closed and memory[CLOSED] == 0.0:
        memory[APPROACH] = approach(memory, nx, ny, before_x, before_y)
        memory[CLOSED] = 1.0
    elif not closed and memory[CLOSED] > 0.0:
        memory[CLOSED] = 0.0
        memory[LOST] += 1.0
    memory[FORCE] = max(0.0, nx * fx + ny * fy)
