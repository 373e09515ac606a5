"""The force of a pin in its bush: restitution, tangents, friction, memory."""

from __future__ import annotations

from math import log
from types import SimpleNamespace

import numpy as np
import pytest
from compiled import compile_scene
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins
from reference.contact_law import HYSTERESIS
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from boom_twin.kernels.elements import pin_contact as contact
from boom_twin.kernels.elements.pin_contact import APPROACH, CLOSED, COLUMNS, LAWS, SMOOTH, restitution_of

STEEL = 2.0 * (1.0 - 0.3**2) / 2.06e11  # s_i + s_j of two bodies of steel, 1/Pa


def row(law="lankarani-nikravesh", restitution=0.9, gap=1e-4, radius=0.030, softness=STEEL, exponent=1.5, friction=0.0):
    """A row of CLEARANCE for `bearing` run as Python."""
    return SimpleNamespace(
        gap=gap, radius=radius, stiffness=contact.contact_stiffness(radius, gap, softness), exponent=exponent,
        loss=contact.LAWS[law](restitution), friction=friction,
    )  # fmt: skip


def memory(entry=None, force=0.0):
    """What a pin remembers in contact that began at `entry` (m/s), or in flight."""
    kept = np.zeros(contact.COLUMNS)
    kept[contact.FORCE] = force
    if entry is not None:
        kept[contact.CLOSED], kept[contact.APPROACH] = 1.0, max(entry, contact.SLOWEST)
    return kept


def bearing(row, kept, x, y, vx, vy, turning=0.0, rate=0.0, axis=(1.0, 0.0)):
    """`contact.bearing` with the velocity at the start of the step equal to that at its end."""
    return contact.pin_force(row, kept, contact.Journal(x, y, vx, vy, vx, vy, turning, *axis), rate)


PUBLISHED = [
    *zip(["lankarani-nikravesh"] * 5, (0.95, 0.9, 0.8, 0.5, 0.3), (0.954, 0.913, 0.847, 0.725, 0.684), strict=True),
    *zip(["flores"] * 3, (0.9, 0.8, 0.5), (0.894, 0.789, 0.470), strict=True),
]
"""Law, the coefficient of restitution that it is asked for, and the one that it is known to leave."""


def restitution(hysteresis):
    """Return the speed after over the speed before an impact, for any stiffness, exponent, mass and speed."""
    if hysteresis == 0.0:
        return 1.0

    def work(u):
        return u / hysteresis - log(1.0 + hysteresis * u) / hysteresis**2

    most = min(1.0, (1.0 - 1e-15) / hysteresis)
    return brentq(lambda e: work(-e) - work(1.0), 1e-12, most, xtol=1e-14)


WITHIN = 0.005  # of a coefficient of restitution
rng = np.random.default_rng(4)
MASS = 20.0  # kg


def compiled(law="lankarani-nikravesh", restitution=0.9, friction=0.0):
    """A row of the compiled table, and a memory that has seen nothing."""
    plan = compile_scene(with_pins(booms.document(), RODS[:1], law=law, restitution=restitution, friction=friction))
    return plan.tables.clearances[0], np.zeros(COLUMNS)


def force(pin, memory, place, velocity=(0.0, 0.0), turning=0.0):
    return np.array(bearing(pin, memory, *place, *velocity, turning))


def kept(law, restitution, speed):
    """The same of a ball that flies from the middle of a hole, its speed of approach being that from the start on."""
    pin, memory = compiled(law, restitution)
    memory[APPROACH], memory[CLOSED] = speed, 1.0
    far = pin.gap - 100.0 * SMOOTH

    def rates(_, state):
        return [state[1], -force(pin, memory, (state[0], 0.0), (state[1], 0.0))[0] / MASS]

    def back(_, state):
        return state[0] - far + 1e-12

    back.terminal, back.direction = True, -1.0
    found = solve_ivp(rates, (0.0, 1.0), [far, speed], "DOP853", events=back, rtol=1e-9, atol=1e-13, max_step=1e-4)
    assert found.status == 1
    return -found.y[1, -1] / speed


@pytest.mark.parametrize(("law", "e", "published"), PUBLISHED)
def test_a_dropped_ball_keeps_what_its_law_is_known_to_leave(law, e, published):
    assert kept(law, e, 0.2) == pytest.approx(published, abs=WITHIN)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("e", [0.95, 0.7, 0.4])
def test_restitution_is_that_of_the_closed_form_whatever_the_speed(law, e):
    expected = restitution(LAWS[law](e))
    assert [kept(law, e, speed) for speed in (0.02, 0.5)] == pytest.approx([expected, expected], abs=2e-3)


@pytest.mark.parametrize("e", [0.05, 0.2, 0.5, 0.7, 0.9, 0.99])
def test_the_exact_law_keeps_what_it_is_asked_for(e):
    """By the kernel's own ball, and by the closed form with the peer's own chi."""
    ours, _ = compiled("hunt-crossley-exact", e)
    assert kept("hunt-crossley-exact", e, 0.2) == pytest.approx(e, abs=0.01)
    chi = HYSTERESIS["hunt-crossley-exact"](e)
    assert restitution(chi) == pytest.approx(e, abs=1e-6)
    assert restitution_of(ours.loss) == pytest.approx(e, abs=1e-9)


def test_nothing_pulls_and_the_elastic_force_rises_outwards():
    pin, memory = compiled()
    memory[APPROACH], memory[CLOSED] = 1e-3, 1.0
    offsets = np.linspace(0.0, 1.5e-4, 400)
    still = np.array([force(pin, memory, (x, 0.0))[0] for x in offsets])
    leaving = np.array([force(pin, memory, (x, 0.0), (-1.0, 0.0))[0] for x in offsets])
    assert still.min() >= 0.0 and leaving.min() >= 0.0
    assert leaving.max() < 0.011 * still.max()
    assert np.diff(still).min() > 0.0  # so that a loaded pin rests in one place only
    assert still[offsets < 0.9e-4].max() < 5.0  # N: smoothing reaches no further


def places(count=40):
    """Offsets about the rim of a bush of 0.1 mm, and velocities."""
    angles, distances = rng.uniform(0.0, 2.0 * np.pi, count), 1e-4 + rng.uniform(-1e-5, 3e-5, count)
    return zip(distances * np.cos(angles), distances * np.sin(angles), *rng.normal(0.0, 0.05, (2, count)), strict=True)


@pytest.mark.parametrize("exponent, rate", [(1.5, 0.0), (1.5, 2000.0), (2.2, 2000.0)])
def test_the_tangent_is_the_derivative_of_the_force(exponent, rate):
    """Of the velocity too, which follows the place by the integrator's rate."""
    pin, kept, step = row(exponent=exponent), memory(0.05), 1e-10
    largest = pin.exponent * pin.stiffness * 3e-5 ** (exponent - 1.0) * (1.0 + pin.loss * rate / 0.05 * 3e-5)
    for x, y, vx, vy in places():

        def force(dx, dy, x=x, y=y, vx=vx, vy=vy):
            return np.array(bearing(pin, kept, x + dx, y + dy, vx + rate * dx, vy + rate * dy, rate=rate)[:2])

        slopes = [(force(step * a, step * b) - force(-step * a, -step * b)) / (2.0 * step) for a, b in ((1, 0), (0, 1))]
        found = bearing(pin, kept, x, y, vx, vy, rate=rate)[2:5]
        symmetric = 0.5 * (slopes[0][1] + slopes[1][0])
        damped = abs(slopes[0][1] - slopes[1][0])  # turning of n under g': left out of the tangent, which stays symmetric
        assert found == pytest.approx([slopes[0][0], symmetric, slopes[1][1]], abs=1e-5 * largest + damped)


def test_the_elastic_force_has_a_potential_that_is_convex():
    pin, d = row("hertz"), contact.SMOOTH

    def energy(x, y):
        depth, n = contact.penetration(pin, x, y)[3], pin.exponent
        return pin.stiffness * (depth ** (n + 1.0) / (n + 1.0) + 0.25 * d * d * depth ** (n - 1.0) / (n - 1.0))

    for x, y, _, _ in places():
        fx, fy, kxx, kxy, kyy, *_ = bearing(pin, memory(0.1), x, y, 0.0, 0.0)
        slope = (energy(x + 1e-9, y) - energy(x - 1e-9, y)) / 2e-9, (energy(x, y + 1e-9) - energy(x, y - 1e-9)) / 2e-9
        assert slope == pytest.approx([fx, fy], rel=1e-4, abs=1e-4)
        assert np.linalg.eigvalsh([[kxx, kxy], [kxy, kyy]])[0] > 0.0


@pytest.mark.parametrize("turning", [0.0, 0.4, -3.0])
def test_friction_takes_energy_and_its_tangent_is_symmetric_and_positive(turning):
    smooth, rough, rate = row(), row(friction=0.2), 2000.0
    for x, y, vx, vy in places():
        kept = memory(0.05, force=5e3)
        a, b = (np.array(bearing(pin, kept, x, y, vx, vy, turning, rate)) for pin in (smooth, rough))
        fx, fy, kxx, kxy, kyy, torque, kx, ky, turn = b - a
        assert fx * vx + fy * vy + torque * turning >= 0.0
        assert np.hypot(fx, fy) <= 0.2 * 5e3 * (1.0 + 1e-9)
        assert torque == pytest.approx(np.copysign(np.hypot(fx, fy) * rough.radius, torque), rel=1e-3)
        values = np.linalg.eigvalsh([[kxx, kxy, kx], [kxy, kyy, ky], [kx, ky, turn]])
        assert values[0] > -1e-6 * values[-1] and values[-1] > 0.0


def test_the_linearised_pin_is_a_spring_and_damper_that_turns_with_its_body():
    kept = memory()
    kept[contact.SPRING], kept[contact.DAMPER], kept[contact.SEAT_X], kept[contact.SEAT_Y] = 3e8, 2e4, 7e-5, -2e-5
    turn = np.exp(0.3j)
    offset, rate, seat = 9e-5 + 4e-5j, 0.01 - 0.02j, complex(7e-5, -2e-5)
    fx, fy, kxx, kxy, kyy, *rest = bearing(
        row(), kept, offset.real, offset.imag, rate.real, rate.imag, rate=500.0, axis=(turn.real, turn.imag)
    )
    assert complex(fx, fy) == pytest.approx(3e8 * (offset - turn * seat) + 2e4 * rate)
    assert (kxx, kxy, kyy) == (3e8 + 500.0 * 2e4, 0.0, 3e8 + 500.0 * 2e4) and not any(rest)


def test_what_a_pin_remembers():
    """The speed of approach when contact begins, at least SLOWEST, until contact is lost, which is counted."""
    pin, kept, rim = row(), memory(), row().gap
    contact.remember(pin, kept, rim - 2.0 * contact.NEAR, 0.0, 0.3, 0.0, 0.0, 0.0)
    assert kept[contact.CLOSED] == 0.0
    contact.remember(pin, kept, rim, 0.0, 0.3, 0.4, 50.0, 7.0)
    assert (kept[contact.CLOSED], kept[contact.FORCE]) == (1.0, pytest.approx(50.0, rel=1e-3))
    assert kept[contact.APPROACH] == pytest.approx(0.3, rel=1e-3)
    contact.remember(pin, kept, rim + 1e-5, 0.0, 0.1, 0.0, 50.0, 0.0)
    assert kept[contact.APPROACH] == pytest.approx(0.3, rel=1e-3) and kept[contact.LOST] == 0.0
    contact.remember(pin, kept, 0.0, 0.0, -0.1, 0.0, 0.0, 0.0)
    assert (kept[contact.CLOSED], kept[contact.LOST]) == (0.0, 1.0)
    contact.remember(pin, kept, rim, 0.0, 1e-5, 0.0, 0.0, 0.0)
    assert kept[contact.APPROACH] == contact.SLOWEST
