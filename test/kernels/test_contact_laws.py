"""The force of a pin in its bush: what a dropped ball keeps, and that the tangent is the force's own."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms
from oracle.clearance.drop import rebound, restitution
from oracle.clearance.scenes import RODS, with_pins
from scipy.integrate import solve_ivp

from boom_twin.compiler.compile import compile_scene
from boom_twin.kernels.elements.pin_contact import (
    APPROACH,
    CLOSED,
    COLUMNS,
    FORCE,
    LAWS,
    LEAST_GAP,
    SMOOTH,
    Journal,
    approach,
    bearing,
    contact_stiffness,
    limited,
    restitution_of,
)
from boom_twin.validation.reference.worn_pin.contact import HYSTERESIS, Contact

PUBLISHED = [
    *(("lankarani-nikravesh", e, kept) for e, kept in ((0.95, 0.954), (0.9, 0.913), (0.8, 0.847), (0.5, 0.725), (0.3, 0.684))),
    *(("flores", e, kept) for e, kept in ((0.9, 0.894), (0.8, 0.789), (0.5, 0.470))),
]
MASS = 20.0  # kg


def pin(law="lankarani-nikravesh", restitution=0.9, friction=0.0):
    """A row of the compiled table, and a memory that has seen nothing."""
    plan = compile_scene(with_pins(booms.document(), RODS[:1], law=law, restitution=restitution, friction=friction))
    return plan.tables.clearances[0], np.zeros(COLUMNS)


def force(row, memory, place, velocity=(0.0, 0.0), turning=0.0, rate=0.0):
    return np.array(bearing(row, memory, Journal(*place, *velocity, *velocity, turning, 1.0, 0.0), rate))


def kept(row, memory, speed):
    """Speed after over speed before of a ball that flies from the middle of a wide hole against its wall."""
    memory[APPROACH], memory[CLOSED] = speed, 1.0
    far = row.gap - 100.0 * SMOOTH

    def rates(_, state):
        return [state[1], -force(row, memory, (state[0], 0.0), (state[1], 0.0))[0] / MASS]

    def back(_, state):
        return state[0] - far + 1e-12

    back.terminal, back.direction = True, -1.0
    found = solve_ivp(rates, (0.0, 1.0), [far, speed], "DOP853", events=back, rtol=1e-9, atol=1e-13, max_step=1e-4)
    assert found.status == 1
    return -found.y[1, -1] / speed


@pytest.mark.parametrize(("law", "e", "published"), PUBLISHED)
def test_a_dropped_ball_keeps_what_its_law_is_known_to_leave(law, e, published):
    row, memory = pin(law, e)
    assert kept(row, memory, 0.2) == pytest.approx(published, abs=0.005)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("e", [0.95, 0.7, 0.4])
def test_restitution_is_that_of_the_closed_form_whatever_the_speed(law, e):
    row, memory = pin(law, e)
    expected = restitution(LAWS[law](e))
    assert [kept(row, memory, 0.02), kept(row, memory, 0.5)] == pytest.approx([expected, expected], abs=2e-3)


@pytest.mark.parametrize("e", [0.05, 0.2, 0.5, 0.7, 0.9, 0.99])
def test_the_exact_law_keeps_what_it_is_asked_for(e):
    """By the kernel's own ball, by the peer's, and by the closed form with the peer's own chi."""
    row, memory = pin("hunt-crossley-exact", e)
    assert kept(row, memory, 0.2) == pytest.approx(e, abs=0.01)
    chi = HYSTERESIS["hunt-crossley-exact"](e)
    assert rebound(Contact(row.stiffness, chi, row.gap, smoothing=SMOOTH), MASS, 0.2) == pytest.approx(e, abs=0.01)
    assert restitution(chi) == pytest.approx(e, abs=1e-6)
    assert restitution_of(row.loss) == pytest.approx(e, abs=1e-9)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("e", [0.95, 0.7, 0.4])
def test_check_states_the_restitution_that_a_law_really_gives(law, e):
    assert restitution_of(LAWS[law](e)) == pytest.approx(restitution(LAWS[law](e)), abs=1e-5)


def test_the_tangent_is_the_derivative_of_the_force():
    row, memory = pin()
    memory[APPROACH], memory[CLOSED], rate, step = 0.01, 1.0, 2e3, 1e-11
    for x, y in ((1.2e-4, 2e-5), (-6e-5, 9e-5), (9.9e-5, -1.2e-5)):
        for velocity in ((0.0, 0.0), (2e-3, -1e-3)):
            base, ways = force(row, memory, (x, y), velocity, rate=rate), []
            for dx, dy in ((step, 0.0), (0.0, step)):
                sides = [
                    force(row, memory, (x + s * dx, y + s * dy), (velocity[0] + s * rate * dx, velocity[1] + s * rate * dy))[:2]
                    for s in (1.0, -1.0)
                ]
                ways.append((sides[0] - sides[1]) / (2.0 * step))
            tangent = np.array([[base[2], base[3]], [base[3], base[4]]])
            allowed = 1e-4 if velocity == (0.0, 0.0) else 0.05  # left out: how the rate of the gap turns with the offset
            assert np.abs(np.array(ways).T - tangent).max() < allowed * np.abs(tangent).max()


def test_nothing_pulls_and_the_elastic_force_rises_outwards():
    row, memory = pin()
    memory[APPROACH], memory[CLOSED] = 1e-3, 1.0
    offsets = np.linspace(0.0, 1.5e-4, 400)
    still = np.array([force(row, memory, (x, 0.0))[0] for x in offsets])
    leaving = np.array([force(row, memory, (x, 0.0), (-1.0, 0.0))[0] for x in offsets])
    assert still.min() >= 0.0 and leaving.min() >= 0.0
    assert leaving.max() < 0.011 * still.max()
    assert np.diff(still).min() > 0.0  # so that a loaded pin rests in one place only
    assert still[offsets < 0.9e-4].max() < 5.0  # N: smoothing reaches no further


def test_friction_opposes_the_slip_of_the_surfaces_and_is_no_more_than_its_share():
    row, memory = pin(friction=0.2)
    place = (1.3e-4, 0.0)
    memory[FORCE] = force(row, memory, place)[0]
    for along, turning in ((0.05, 0.0), (-0.05, 0.0), (0.0, 3.0), (0.0, -3.0)):
        found = force(row, memory, place, (0.0, along), turning)
        slip = along + row.radius * turning
        assert found[1] * slip > 0.0  # what holds the journal back has the sign of its slip
        assert abs(found[1]) == pytest.approx(0.2 * memory[FORCE], rel=0.01)
        assert found[5] == pytest.approx(row.radius * found[1], rel=1e-4)
    assert force(row, memory, place)[1] == 0.0


def test_stiffness_is_capped_where_the_clearance_vanishes():
    softness = 2.0 * (1.0 - 0.3**2) / 2.06e11
    assert contact_stiffness(0.03, 1e-4, softness) == pytest.approx(4.5e11, rel=0.02)
    assert contact_stiffness(0.03, 1e-6, softness) == contact_stiffness(0.03, LEAST_GAP, softness)
    assert contact_stiffness(0.03, 4.0 * LEAST_GAP, softness) < 0.51 * contact_stiffness(0.03, LEAST_GAP, softness)


def test_an_increment_claims_little_beyond_the_wall():
    row, _ = pin()
    x, y = limited(row, 0.0, 0.0, 3e-3, 4e-3)
    assert np.hypot(x, y) < row.gap + 20.0 * SMOOTH
    assert [x, y] == pytest.approx(np.hypot(x, y) * np.array([0.6, 0.8]))
    assert limited(row, 5e-5, 0.0, 1e-5, 0.0) == (1e-5, 0.0)


def test_the_speed_of_approach_is_frozen_while_they_touch():
    _, memory = pin()
    assert approach(memory, 1.0, 0.0, 0.3, 9.0) == 0.3
    assert approach(memory, 1.0, 0.0, -0.3, 0.0) == 1e-3
    memory[CLOSED], memory[APPROACH] = 1.0, 0.02
    assert approach(memory, 1.0, 0.0, 0.3, 0.0) == 0.02
