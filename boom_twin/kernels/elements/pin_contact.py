"""A journal in a bush with clearance: the force between pin and hole, as contact or as its linearisation.

The journal's centre is off the bush's by delta = (x, y). With r = sqrt(|delta|^2 + s^2), n = delta/r, s = `SMOOTH`,

    gap g = r - c,    penetration d = [g + sqrt(g^2 + s^2)]/2,    g' = n.delta',
    F = K d^e [1 + chi g'/v],        K = 4/[3 (s_i + s_j)] sqrt(R_i R_j/(R_j - R_i)),

c the radial clearance, v the speed of approach when contact began, s_i = (1 - nu^2)/E of each body, R_i and R_j = R_i + c the
radii. K grows without bound as c vanishes while the pin becomes ideal, so R_j - R_i is not taken below `LEAST_GAP` in it.
K and the form of F: Lankarani and Nikravesh 1990, the second paper's model ([R] in `boom_twin.scene.notation`); the laws differ
in chi, a function of the coefficient of restitution each. The bracket is kept above `LEAST_SHARE`: nothing pulls, and a
journal without mass, which leaves as fast as it likes, is still held somewhere. With g' in the bracket the rebound does not
depend on how d is smoothed. The elastic part is convex in delta: at rest a pin has one place.

Friction against the slip of the surfaces, w = n x delta' + R_i (turning of the journal in the bush): mu F w/sqrt(w^2 + w_s^2),
with F of the step before, which leaves the tangent symmetric.

Linearised at a preload F_0 with penetration d_0, the pin is a spring k = e F_0/d_0 and a damper chi F_0/v about the place from
which F_0 stretches it to c + d_0. That place is fixed to the cylinder, or to the body that holds the bush of a pivot or link
pin: it turns with the force of a cylinder, and stays on its side when the force reverses.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..jit import inner

SMOOTH = 1e-6  # m, over which contact sets in
NEAR = 4.0 * SMOOTH  # m, width of the gap at which journal and bush count as touching
LEAST_GAP = 3e-5  # m, least difference of radii in K
SLOWEST = 1e-3  # m/s, least speed of approach
LEAST_RESTITUTION = 0.01  # that chi is solved for
LEAST_SHARE = 0.01  # of the elastic force, however fast the journal leaves
SLIP = 1e-3  # m/s, slip at which friction has 0.7 of its full size

# Places of pins; typed, because numba compiles once more for every literal.
PIVOT, LINK_L_PIN, LINK_R_PIN, Q_PIN, ROD_END_PIN, BARREL_END_PIN = map(np.int64, range(6))


class Journal(NamedTuple):
    """Position and velocity of a journal in its bush.

    x, y : offset, m. vx, vy : its velocity, m/s. before_x, before_y : that at the start of the step, m/s.
    turning : of the journal in the bush, rad/s. axis_x, axis_y : first axis of what the linearisation is fixed to.
    """

    x: float
    y: float
    vx: float
    vy: float
    before_x: float
    before_y: float
    turning: float
    axis_x: float
    axis_y: float


class PinForce(NamedTuple):
    """Contact force and friction torque that hold a journal back, and their derivatives.

    x, y : force, N. xx, xy, yy : its tangent by the offset, N/m.
    torque : of friction, N m. torque_x, torque_y, torque_turn : its derivatives by the offset (N) and by the turning (N m).
    """

    x: float
    y: float
    xx: float
    xy: float
    yy: float
    torque: float
    torque_x: float
    torque_y: float
    torque_turn: float


# Columns of `Work.hold`, a `PinForce` for every pin.
HOLD_X, HOLD_Y, K_XX, K_XY, K_YY, TORQUE, TORQUE_X, TORQUE_Y, TORQUE_TURN, HOLD_COLUMNS = range(10)

CLEARANCE = np.dtype(
    [
        ("z", np.int64),  # place of delta among the unknowns
        ("owner", np.int64),  # row of its joint and cylinder ..
        ("place", np.int64),  # .. and which pin of them it is
        ("turn", np.int64),  # place of the journal's angle in the bush among the histories, if there is friction
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

# What a pin remembers: whether it touches, speed of approach (m/s), normal force (N); spring (N/m; 0: contact), damper
# (N s/m) and place (m, in the axes it is fixed to) of the linearisation; how often contact was lost.
CLOSED, APPROACH, FORCE, SPRING, DAMPER, SEAT_X, SEAT_Y, LOST, COLUMNS = range(9)


def hertz(restitution: float) -> float:
    """Elastic contact, without loss: 0 (Hertz 1882)."""
    return 0.0


def lankarani_nikravesh(restitution: float) -> float:
    """Nearly elastic contact: 3 (1 - e^2)/4 (Lankarani and Nikravesh 1990)."""
    return 0.75 * (1.0 - restitution**2)


def flores(restitution: float) -> float:
    """Elastic to plastic contact: 8 (1 - e)/(5 e) (Flores, Machado, Silva and Martins 2011)."""
    return 1.6 * (1.0 - restitution) / restitution


def hunt_crossley(restitution: float) -> float:
    """Hard contact at low speed: 3 (1 - e)/2 (Hunt and Crossley 1975)."""
    return 1.5 * (1.0 - restitution)


def hunt_crossley_exact(restitution: float) -> float:
    """Hunt and Crossley's force with the chi that really gives this restitution, solved for; see `restitution_of`."""
    wanted, low, high = max(restitution, LEAST_RESTITUTION), 0.0, 1.0
    while restitution_of(high) > wanted:
        low, high = high, 2.0 * high
    return bisect(lambda chi: restitution_of(chi) > wanted, low, high)


LAWS = {
    "hertz": hertz,
    "lankarani-nikravesh": lankarani_nikravesh,
    "flores": flores,
    "hunt-crossley": hunt_crossley,
    "hunt-crossley-exact": hunt_crossley_exact,
}


def restitution_of(loss: float) -> float:
    """The restitution that an impact with chi = `loss` really has, whatever speed, mass, K and exponent.

    With u the speed over that of approach, m v^2 u du = -K d^e (1 + chi u) dd integrates to G(-e) = G(1) over an impact, with
    G(u) the integral of s/max(1 + chi s, `LEAST_SHARE`) from 0 to u (Gonthier, McPhee, Lange and Piedboeuf 2004).
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
    """Return the place between `low` and `high` where `is_below` turns from true to false."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_below(middle) else (low, middle)
    return 0.5 * (low + high)


def contact_stiffness(radius: float, gap: float, softness: float) -> float:
    """K (N/m^1.5) of a pin of `radius` in a hole wider by `gap` (m); softness = s_i + s_j (1/Pa)."""
    apart = max(gap, LEAST_GAP)
    return 4.0 / (3.0 * softness) * math.sqrt(radius * (radius + apart) / apart)


@inner
def penetration(row, x, y):
    """Direction n, distance r, penetration d and dd/dg of a journal at (x, y)."""
    r = math.sqrt(x * x + y * y + SMOOTH * SMOOTH)
    gap = r - row.gap
    root = math.sqrt(gap * gap + SMOOTH * SMOOTH)
    d = 0.5 * (gap + root) if gap > 0.0 else 0.5 * SMOOTH * SMOOTH / (root - gap)
    return x / r, y / r, r, d, d / root


@inner
def approach(memory, nx, ny, vx, vy):
    """Speed of approach (m/s): the one remembered, else that of the velocity (vx, vy) at the start of the step."""
    if memory[CLOSED] > 0.0:
        return memory[APPROACH]
    return max(SLOWEST, nx * vx + ny * vy)


@inner
def pin_force(row, memory, journal, rate):
    """The `PinForce` of the pin `row` on a `Journal`; rate : C of the integrator, dv/dx."""
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
    """Increments of delta, shortened so that the penetration does not much more than double in a pass.

    A pass from inside the gap knows no contact; this is the active set's limit on what it may claim.
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
    """Note contact that began or ended in a step that is accepted, and the force."""
    nx, ny, r, _, _ = penetration(row, x, y)
    closed = r - row.gap > -NEAR
    if closed and memory[CLOSED] == 0.0:
        memory[APPROACH] = approach(memory, nx, ny, before_x, before_y)
        memory[CLOSED] = 1.0
    elif not closed and memory[CLOSED] > 0.0:
        memory[CLOSED] = 0.0
        memory[LOST] += 1.0
    memory[FORCE] = max(0.0, nx * fx + ny * fy)
