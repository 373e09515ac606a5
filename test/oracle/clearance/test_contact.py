"""The force law itself: its limits, its inverse, its friction."""

from __future__ import annotations

import pytest

from boom_twin.validation.contact_law import HYSTERESIS, LEAST_SPEED, Contact, stiffness

STEEL = stiffness(0.025, 1e-4, 2.06e11, 0.3)


@pytest.mark.parametrize("smoothing", [0.0, 1e-6, 5e-6])
@pytest.mark.parametrize("force", [30.0 + 0j, -2e4 + 5e4j, 1e5j])
def test_resting_offset_inverts_the_force(smoothing, force):
    contact = Contact(STEEL, 0.1, 1e-4, smoothing=smoothing)
    assert contact.force(contact.resting_offset(force), 0j, 0.0) == pytest.approx(-force, rel=1e-6)


@pytest.mark.parametrize("smoothing", [0.0, 1e-6])
def test_damping_takes_and_never_pulls(smoothing):
    contact = Contact(STEEL, HYSTERESIS["flores"](0.5), 1e-4, smoothing=smoothing)
    still, pressed, leaving = (contact.normal(2e-5, rate, 0.1) for rate in (0.0, 0.1, -0.1))
    assert pressed == pytest.approx((1.0 + contact.hysteresis) * still, rel=1e-3)
    assert leaving == 0.0 < still
    assert contact.normal(2e-5, 1e-4, 0.0) == contact.normal(2e-5, 1e-4, LEAST_SPEED)
    assert contact.normal(2e-5, 0.1, None) == still


def test_friction_opposes_the_slide_around_the_bush():
    contact = Contact(STEEL, 0.0, 1e-4, friction=0.2)
    offset, normal = 1.2e-4 + 0j, contact.normal(2e-5, 0.0, None)
    assert contact.force(offset, 1j, None) == pytest.approx(-normal * (1.0 + 0.2j))
    assert contact.force(offset, -1j, None) == pytest.approx(-normal * (1.0 - 0.2j))
    assert contact.force(offset, 0j, None) == pytest.approx(-normal)
