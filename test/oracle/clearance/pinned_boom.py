"""A part of a boom on a massive cylinder whose rod pin has play: Lagrange's equations by hand in three coordinates.

phi, the part's heading; l and psi, length and heading of the cylinder from its barrel pin B to its rod's pin r. The rod's
pin lies at offset = r - P(phi) from the bush, and is pushed by F (contact). With u = e^(i psi), <a, b> = Re(conj(a) b):

    J phi''   + J' phi'^2 / 2               = -<F, P'> + <g, sum m z'>
    m_r l''   - I_l psi'^2 / 2              =  <F, u>  + m_r <g, u> - k (l - l_ref) - d (l' - l_ref')
    I psi''   + I_l l' psi'                 =  <F, i l u> + (m_b a_b + m_r (l - a_r)) <g, i u>

    I(l) = I_b + m_b a_b^2 + I_r + m_r (l - a_r)^2 ,      I_l = dI/dl = 2 m_r (l - a_r) .

The mass matrix is diagonal, and nothing but F joins the part to the cylinder.
"""

from __future__ import annotations

from cmath import exp, phase
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, root

from .contact import Contact
from .impacts import Episode, follow


@dataclass(frozen=True)
class Cylinder:
    """Barrel pin (complex, m), oil spring (N/m) and damper (N s/m), barrel and rod (kg, kg m^2, m from their own pins)."""

    pin: complex
    k: float
    d: float
    barrel_mass: float
    barrel_inertia: float
    barrel_com: float
    rod_mass: float
    rod_inertia: float
    rod_com: float


@dataclass(frozen=True)
class Rest:
    """An equilibrium: heading phi, length l, heading psi of the cylinder; offset (m) and force (N) of the pin, complex."""

    phi: float
    length: float
    psi: float
    tip: complex
    offset: complex
    force: complex
    tension: float


@dataclass(frozen=True)
class Followed:
    """A motion in m rows: tip, offset of the pin in the bush (m), force of the bush on the pin (N), each (m, 2).

    `phi`, `tension` (N, of the oil) and `energy` (J, oil, weight and motion, without that of the contact): (m,).
    """

    times: np.ndarray
    tip: np.ndarray
    offset: np.ndarray
    force: np.ndarray
    phi: np.ndarray
    tension: np.ndarray
    energy: np.ndarray
    episodes: list[Episode]


@dataclass(frozen=True)
class PinnedBoom:
    """`part`: a `Lever` or `SixBar`; `contact` None: an ideal pin, for `rest` only; gravity complex, m/s^2."""

    part: object
    cylinder: Cylinder
    contact: Contact | None
    gravity: complex

    def rest(self, drive, phi):
        """Equilibrium at a length of the drive (m), near heading `phi` (rad), as a `Rest`.

        Found from the force to the place: the force of the oil tells where the pin lies, and the pin's place must close
        the loop. No gap is ever iterated on.
        """
        unit = 1e4

        def parts(x):
            phi, tension, psi = x[0], unit * x[1], x[2]
            length, placed = drive + tension / self.cylinder.k, self.part.at(phi)
            force = self._holding(length, psi, tension)
            offset = 0j if self.contact is None else self.contact.resting_offset(-force)
            return length, psi, placed, force, offset

        def mismatch(x):
            length, psi, placed, force, offset = parts(x)
            loop = self.cylinder.pin + length * exp(1j * psi) - placed.pin.value - offset
            return [loop.real, loop.imag, (_dot(self.gravity, placed.moments) - _dot(force, placed.pin.first)) / unit]

        found = root(mismatch, self._guess(drive, phi, unit), method="hybr", options={"xtol": 1e-15})
        if max(np.abs(found.fun)) > 1e-10:
            raise ArithmeticError(f"no equilibrium at {drive:g} m near {phi:g} rad: {found.message}")
        length, psi, _, force, offset = parts(found.x)
        return Rest(found.x[0], length, psi, self.part.tip_at(found.x[0]), offset, force, unit * found.x[1])

    def follow(self, drive, rest, times, breaks=(), tolerance=1e-8, method="LSODA", rate=0.0):
        """Motion from an equilibrium, as `Followed`.

        Parameters
        ----------
        drive : callable
            Time (s) -> length (m) and rate (m/s) of the drive.
        rest : Rest
        times : ndarray, shape (m,)
        breaks : sequence of float
            Times at which the drive's rate is not smooth.
        rate : float
            Rate of phi at the start, rad/s.
        """
        zero = np.array([rest.phi, rest.length, rest.psi, 0.0, 0.0, 0.0])

        def rates(time, state, entry):
            return self.rates(drive(time), zero + state, entry)

        def gap(time, state):
            return self.gap(zero + state)

        start = np.array([0.0, 0.0, 0.0, rate, 0.0, 0.0])
        absolute = tolerance * np.repeat([1e-5, 1e-2], 3)
        found = follow(rates, gap, start, times, tolerance, absolute, breaks, 1e-2, method)
        return self._rows(drive, found, zero + found.states)

    def rates(self, drive, state, entry):
        """Derivative of (phi, l, psi, phi', l', psi') at length and rate of the drive."""
        phi, length, psi, turn, speed, swing = (float(value) for value in state)
        c, g, u, placed = self.cylinder, self.gravity, exp(1j * psi), self.part.at(phi)
        force = self.contact.force(*self._pin(length, u, turn, speed, swing, placed), entry)
        lead = c.rod_mass * (length - c.rod_com)
        weight = (c.barrel_mass * c.barrel_com + lead) * _dot(g, 1j * u)
        oil = c.k * (length - drive[0]) + c.d * (speed - drive[1])
        return [
            turn, speed, swing,
            (_dot(g, placed.moments) - _dot(force, placed.pin.first) - 0.5 * placed.slope * turn**2) / placed.inertia,
            (_dot(force, u) - oil) / c.rod_mass + _dot(g, u) + lead * swing**2 / c.rod_mass,
            (_dot(force, 1j * length * u) + weight - 2.0 * lead * speed * swing) / self._swing(length),
        ]  # fmt: skip

    def gap(self, state):
        """Gap (m, positive in contact) and its rate (m/s)."""
        offset, rate = self.pin(state)
        distance = abs(offset)
        return self.contact.gap(offset), _dot(offset, rate) / distance if distance else abs(rate)

    def pin(self, state):
        """Offset (m) of the pin in the bush and its rate (m/s), complex."""
        phi, length, psi, turn, speed, swing = state
        return self._pin(length, exp(1j * psi), turn, speed, swing, self.part.at(phi))

    def energy(self, drive, state):
        """Of motion, weight and oil, J; not of the contact."""
        phi, length, psi, turn, speed, swing = state
        c, placed, u = self.cylinder, self.part.at(phi), exp(1j * psi)
        moving = placed.inertia * turn**2 + c.rod_mass * speed**2 + self._swing(length) * swing**2
        height = placed.height + (c.barrel_mass * c.barrel_com + c.rod_mass * (length - c.rod_com)) * u
        return 0.5 * moving + 0.5 * c.k * (length - drive) ** 2 - _dot(self.gravity, height)

    def _pin(self, length, u, turn, speed, swing, placed):
        rate = (speed + 1j * length * swing) * u - placed.pin.first * turn
        return self.cylinder.pin + length * u - placed.pin.value, rate

    def _swing(self, length):
        """I(l), kg m^2."""
        c = self.cylinder
        still = c.barrel_inertia + c.barrel_mass * c.barrel_com**2 + c.rod_inertia
        return still + c.rod_mass * (length - c.rod_com) ** 2

    def _holding(self, length, psi, tension):
        """Force (N) on the rod's pin that holds the cylinder still at a tension of the oil."""
        c, u = self.cylinder, exp(1j * psi)
        tilt = (c.barrel_mass * c.barrel_com + c.rod_mass * (length - c.rod_com)) / length
        return (tension - c.rod_mass * _dot(self.gravity, u) - 1j * tilt * _dot(self.gravity, 1j * u)) * u

    def _guess(self, drive, phi, unit):
        """The stiff boom with an ideal pin."""
        near = [phi + step for step in np.linspace(-0.05, 0.05, 21)]
        reach = [self._span(angle) - drive for angle in near]
        for a, b, at, bt in zip(near, near[1:], reach, reach[1:], strict=False):
            if at * bt <= 0.0:
                phi = brentq(lambda angle: self._span(angle) - drive, a, b)
        placed = self.part.at(phi)
        axis = placed.pin.value - self.cylinder.pin
        tension = _dot(self.gravity, placed.moments) / _dot(axis / abs(axis), placed.pin.first)
        return [phi, tension / unit, phase(axis)]

    def _span(self, phi):
        return abs(self.part.at(phi).pin.value - self.cylinder.pin)

    def _rows(self, drive, found, states):
        pins = [self.pin(state) for state in states]
        entries = [None if np.isnan(entry) else entry for entry in found.entries]
        c, drives = self.cylinder, [drive(time) for time in found.times]
        return Followed(
            found.times,
            _pairs([self.part.tip_at(state[0]) for state in states]),
            _pairs([offset for offset, _ in pins]),
            _pairs([self.contact.force(*pin, entry) for pin, entry in zip(pins, entries, strict=True)]),
            states[:, 0],
            np.array([c.k * (s[1] - r[0]) + c.d * (s[4] - r[1]) for s, r in zip(states, drives, strict=True)]),
            np.array([self.energy(r[0], s) for s, r in zip(states, drives, strict=True)]),
            found.episodes,
        )


def _dot(a, b):
    return (a.conjugate() * b).real


def _pairs(values):
    values = np.array(values)
    return np.column_stack([values.real, values.imag])
