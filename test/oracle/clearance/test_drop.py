"""Restitution of the contact laws: published figures, integration, closed form."""

from __future__ import annotations

import pytest
from oracle.clearance.drop import rebound, restitution

from boom_twin.validation.contact_law import HYSTERESIS, Contact, stiffness

STEEL = stiffness(0.030, 1e-4, 2.06e11, 0.3)
PUBLISHED = [
    *zip(["lankarani-nikravesh"] * 5, (0.95, 0.9, 0.8, 0.5, 0.3), (0.954, 0.913, 0.847, 0.725, 0.684), strict=True),
    *zip(["flores"] * 3, (0.9, 0.8, 0.5), (0.894, 0.789, 0.470), strict=True),
]


def test_stiffness_of_the_notes():
    """R 30 mm, c 0.1 mm, steel: 4.5e11 N/m^1.5."""
    assert pytest.approx(4.5e11, rel=0.02) == STEEL


@pytest.mark.parametrize("law, e, expected", PUBLISHED)
def test_published(law, e, expected):
    hysteresis = HYSTERESIS[law](e)
    assert restitution(hysteresis) == pytest.approx(expected, abs=6e-4)
    assert rebound(Contact(STEEL, hysteresis, 0.0), 20.0, 0.1) == pytest.approx(expected, abs=6e-4)


@pytest.mark.parametrize("law", HYSTERESIS)
@pytest.mark.parametrize("e", [0.95, 0.6, 0.3])
@pytest.mark.parametrize("exponent, mass, speed", [(1.5, 20.0, 0.1), (1.0, 0.5, 3.0), (2.2, 300.0, 0.02)])
def test_integration_meets_the_closed_form(law, e, exponent, mass, speed):
    hysteresis = HYSTERESIS[law](e)
    contact = Contact(STEEL, hysteresis, 0.0, exponent)
    assert rebound(contact, mass, speed) == pytest.approx(restitution(hysteresis), abs=1e-7)


def test_smoothing_changes_little():
    """A ball that goes some 30 smoothing lengths deep."""
    sharp = HYSTERESIS["lankarani-nikravesh"](0.9)
    found = rebound(Contact(STEEL, sharp, 0.0, smoothing=1e-6), 20.0, 0.1)
    assert found == pytest.approx(restitution(sharp), abs=2e-3)


def test_slow_touches_are_damped_as_if_at_the_least_speed():
    hysteresis = HYSTERESIS["lankarani-nikravesh"](0.5)
    assert rebound(Contact(STEEL, hysteresis, 0.0), 20.0, 2e-4) > restitution(hysteresis) + 0.1
