"""The law of a pin beyond the usual: faint impacts, other exponents, convexity, tangents, what a pin remembers."""

from __future__ import annotations

import numpy as np
import pytest
from kernels.journal import Journal, bearing, memory, row
from oracle.clearance.drop import restitution

from boom_twin.kernels.elements import pin_contact as contact
from boom_twin.validation.reference.worn_pin.impacts import follow

WITHIN = 0.005  # of a coefficient of restitution
rng = np.random.default_rng(4)


def rebound(pin, mass, speed):
    """Speed after over speed before an impact of a ball (kg, m/s) without weight; the bush is so wide that it is a plane."""
    pin.gap = 1.0
    journal, height = Journal(pin), 100.0 * contact.SMOOTH
    deepest = (mass * speed**2 / pin.stiffness) ** (1.0 / (pin.exponent + 1.0))
    times = np.array([0.0, 20.0 * (deepest + height) / speed])
    found = follow(
        lambda time, state, entry: [state[1], journal.force(complex(pin.gap + state[0]), complex(state[1]), entry).real / mass],
        lambda time, state: (state[0] + contact.NEAR, state[1]), [-height, speed], times, 1e-9,
        1e-9 * np.array([deepest, speed]), method="DOP853",
    )  # fmt: skip
    return -found.states[-1, 1] / speed


def test_a_ball_that_hardly_touches():
    """Two smoothing lengths deep, 1 mJ: the tail of the smoothed gap slows it down before it counts as touching."""
    pin = row()
    assert rebound(pin, 20.0, 0.01) == pytest.approx(restitution(pin.loss), abs=0.03)


@pytest.mark.parametrize("exponent", [1.2, 2.2])
def test_restitution_for_other_exponents(exponent):
    """With a stiffness for which the ball goes 20 um deep."""
    pin, mass, speed = row("lankarani-nikravesh", 0.7, exponent=exponent), 20.0, 0.1
    pin.stiffness = 0.5 * (exponent + 1.0) * mass * speed**2 / 2e-5 ** (exponent + 1.0)
    assert rebound(pin, mass, speed) == pytest.approx(restitution(pin.loss), abs=WITHIN)


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
