"""A planar slider-crank driven at constant speed, with play between connecting rod and slider; nothing weighs.

Coordinates: heading of the rod (rad) and place of the slider (m). The pin is the slider's, the bush the rod's. The rod
(mass m, centre a from the crank pin A, inertia J about its centre, length L) turns about A, which the crank accelerates:

    (J + m a^2) psi'' = moment about A of F on the rod at L, and of -m A'' at a ;     m_s x'' = F_x on the slider .
"""

from __future__ import annotations

from cmath import exp
from dataclasses import dataclass
from math import asin, pi

import numpy as np
from reference.worn_pin.impacts import ContactMotion, follow

from boom_twin.validation.contact_law import HYSTERESIS, Contact, stiffness


@dataclass(frozen=True)
class SliderCrank:
    """Lengths in m, masses in kg, kg m^2, crank speed in rad/s."""

    contact: Contact
    crank: float
    rod: float
    speed: float
    rod_mass: float
    rod_inertia: float
    slider_mass: float

    def pin(self, time, state):
        """Offset of the pin in the bush (m) and its rate (m/s), complex."""
        psi, x, turn, v = state
        hand, arm = self.crank * exp(1j * self.speed * time), self.rod * exp(1j * psi)
        return x - hand - arm, v - 1j * (self.speed * hand + turn * arm)

    def rates(self, time, state, entry):
        """Derivative of (psi, x, psi', x'); the rod's centre is its middle."""
        psi, _, turn, v = state
        force = self.contact.force(*self.pin(time, state), entry)
        arm = self.rod * exp(1j * psi)
        hand = -self.crank * self.speed**2 * exp(1j * self.speed * time)
        load = -force * arm.conjugate() - self.rod_mass * hand * (0.5 * arm).conjugate()
        return [turn, v, load.imag / (self.rod_inertia + 0.25 * self.rod_mass * self.rod**2), force.real / self.slider_mass]

    def gap(self, time, state):
        """Gap (m) and its rate (m/s)."""
        offset, rate = self.pin(time, state)
        distance = abs(offset)
        return self.contact.gap(offset), (rate * offset.conjugate()).real / distance if distance else abs(rate)

    def closed(self, angle):
        """State of the mechanism without play at a crank angle (rad)."""
        hand = self.crank * exp(1j * angle)
        psi = asin(-hand.imag / self.rod)
        arm = self.rod * exp(1j * psi)
        turn = -self.speed * hand.real / arm.real
        return [psi, (hand + arm).real, turn, (1j * (self.speed * hand + turn * arm)).real]

    def run(self, turns, rows, tolerance=1e-9, method="DOP853") -> ContactMotion:
        """From crank angle 0, the pin in the middle of the bush, over some turns of the crank."""
        period = 2.0 * pi / self.speed
        absolute = tolerance * np.array([1e-3, 1e-3, 1.0, 1.0])
        return follow(
            self.rates, self.gap, self.closed(0.0), np.linspace(0.0, turns * period, rows), tolerance, absolute,
            longest=period / 200.0, method=method,
        )  # fmt: skip


def demonstration(law="lankarani-nikravesh", restitution=0.9, clearance=0.5e-3, rpm=5000.0):
    """The slider-crank of Flores and others: crank 50 mm, rod 120 mm, bush of 10 mm radius, steel."""
    contact = Contact(stiffness(0.010 - clearance, clearance, 207e9, 0.3), HYSTERESIS[law](restitution), clearance)
    return SliderCrank(contact, 0.05, 0.12, rpm * pi / 30.0, 0.21, 2.5e-4, 0.14)
