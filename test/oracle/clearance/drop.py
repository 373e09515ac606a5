"""A ball dropped on a plane: the restitution that a contact law really gives, by integration and in closed form.

With u the speed over that of the approach, m v_in^2 u du = -K d^n (1 + chi u) dd. Both sides integrate, and over a whole
impact the depth drops out, whatever n is:

    G(-e) = G(1) ,      G(u) = integral of s / (1 + chi s) from 0 to u = u / chi - log(1 + chi u) / chi^2 .
"""

from __future__ import annotations

from math import log

import numpy as np
from reference.worn_pin.impacts import follow
from scipy.optimize import brentq

APPROACH = 100.0  # smoothing lengths, from where a smoothed contact is out of reach
PUBLISHED = [
    *zip(["lankarani-nikravesh"] * 5, (0.95, 0.9, 0.8, 0.5, 0.3), (0.954, 0.913, 0.847, 0.725, 0.684), strict=True),
    *zip(["flores"] * 3, (0.9, 0.8, 0.5), (0.894, 0.789, 0.470), strict=True),
]
"""Law, the coefficient of restitution that it is asked for, and the one that it is known to leave."""


def rebound(contact, mass, speed, tolerance=1e-10):
    """Speed after over speed before an impact of a ball (kg, m/s), without weight; by integration."""
    height = max(APPROACH * contact.smoothing, 1e-9)
    deepest = (mass * speed**2 / contact.stiffness) ** (1.0 / (contact.exponent + 1.0))
    lasting = 20.0 * (deepest + height) / speed

    def rates(time, state, entry):
        return [state[1], -contact.normal(state[0], state[1], entry) / mass]

    found = follow(
        rates, lambda time, state: state, [-height, speed], np.array([0.0, lasting]), tolerance,
        np.array([tolerance * deepest, tolerance * speed]), method="DOP853",
    )  # fmt: skip
    return -found[-1, 1] / speed


def restitution(hysteresis):
    """The same in closed form, for any stiffness, exponent, mass and speed."""
    if hysteresis == 0.0:
        return 1.0

    def work(u):
        return u / hysteresis - log(1.0 + hysteresis * u) / hysteresis**2

    most = min(1.0, (1.0 - 1e-15) / hysteresis)
    return brentq(lambda e: work(-e) - work(1.0), 1e-12, most, xtol=1e-14)
