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
