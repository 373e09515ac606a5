"""Motion of the reference boom with a worn pin: Lagrange's equations in three coordinates, equilibrium, set-up from a scene.

With the pin held at an offset, one equation in the heading is left: the oil, as long as it then is, must carry the part. Its
force tells on which side of the bush the pin really lies and how deep. The offset hardly changes the force, so that a few
passes suffice.

phi, the part's heading; l and psi, length and heading of the cylinder from its barrel pin B to its rod's pin r. The rod's
pin lies at offset = r - P(phi) from the bush, and is pushed by F (contact). With u = e^(i psi), <a, b> = Re(conj(a) b):

    J phi''   + J' phi'^2 / 2               = -<F, P'> + <g, sum m z'>
    m_r l''   - m_r (l - a_r) psi'^2        =  <F, u>  + m_r <g, u> - k (l - l_ref) - d (l' - l_ref')
    I psi''   + 2 m_r (l - a_r) l' psi'     =  <F, i l u> + (m_b a_b + m_r (l - a_r)) <g, i u> .

J(phi) and P(phi) are the part's (`parts`), I(l) the cylinder's. The mass matrix is diagonal, and nothing but F joins the two.
"""

from __future__ import annotations

from cmath import exp, phase
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from reference.contact_law import Contact
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from . import geometry
from .bodies import Lever, OilCylinder, SixBar
from .geometry import Document, Point, dot

NEAR = 0.05  # rad, about the guess
PASSES = 40
SAME = 1e-14  # m, offsets


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


Drive = Callable[[float], tuple[float, float]]

LONGEST = 1e-2  # s, step


@dataclass(frozen=True)
class PinMotion:
    """A motion in m rows: tip and offset of the pin in the bush (m), each (m, 2)."""

    tip: np.ndarray
    offset: np.ndarray


@dataclass(frozen=True)
class PinnedBoom:
    """`part`: a `Lever` or `SixBar`; gravity complex, m/s^2."""

    part: Lever | SixBar
    cylinder: OilCylinder
    contact: Contact
    gravity: complex

    def rest(self, drive: float, phi: float) -> Rest:
        """Equilibrium at a length of the drive (m), within `NEAR` of heading `phi` (rad); ArithmeticError if there is none."""
        offset = 0j
        for _ in range(PASSES):
            rest = self._held(drive, phi, offset)
            found = self.contact.resting_offset(-rest.force)
            if abs(found - offset) < SAME:
                return rest
            offset = found
        raise ArithmeticError(f"no side to lie on at {drive:g} m near {phi:g} rad: the pin bears {abs(rest.force):g} N")

    def follow(self, drive: Drive, rest: Rest, times: np.ndarray, breaks: Sequence[float] = ()) -> PinMotion:
        """Motion from an equilibrium to ascending `times` (s); `breaks`: of the drive."""
        # states are deviations from the rest, so that a relative tolerance means something
        zero, tolerance = np.array([rest.phi, rest.length, rest.psi, 0.0, 0.0, 0.0]), 1e-8
        deviations = follow(
            lambda time, state, entry: self.rates(drive(time), zero + state, entry),
            lambda time, state: self.gap(zero + state),
            [0.0] * 6, times, breaks,
            method="LSODA", rtol=tolerance, atol=tolerance * np.repeat([1e-5, 1e-2], 3), max_step=LONGEST,
        )  # fmt: skip
        states = zero + deviations
        return PinMotion(
            _pairs([self.part.tip_at(state[0]) for state in states]),
            _pairs([self.pin(state)[0] for state in states]),
        )

    def rates(self, drive: tuple[float, float], state: np.ndarray, entry: float | None) -> list[float]:
        """Derivative of (phi, l, psi, phi', l', psi') at length and rate of the drive."""
        phi, length, psi, turn, speed, swing = (float(value) for value in state)
        c, g, u, placed = self.cylinder, self.gravity, exp(1j * psi), self.part.at(phi)
        force = self.contact.force(*self._pin(length, u, turn, speed, swing, placed.pin), entry)
        arm = length - c.rod_com
        moment = dot(g, placed.moments) - dot(force, placed.pin.first) - 0.5 * placed.slope * turn**2
        pull = dot(force, u) - c.tension(length, speed, drive)
        tilt = dot(force, 1j * length * u) + c.moment(length) * dot(g, 1j * u) - 2.0 * c.rod_mass * arm * speed * swing
        bends = moment / placed.inertia, pull / c.rod_mass + dot(g, u) + arm * swing**2, tilt / c.inertia(length)
        return [turn, speed, swing, *bends]

    def gap(self, state: np.ndarray) -> tuple[float, float]:
        """Gap (m, positive in contact) and its rate (m/s)."""
        offset, rate = self.pin(state)
        distance = abs(offset)
        return self.contact.gap(offset), dot(offset, rate) / distance if distance else abs(rate)

    def pin(self, state: np.ndarray) -> tuple[complex, complex]:
        """Offset (m) of the pin in the bush and its rate (m/s), complex."""
        phi, length, psi, turn, speed, swing = (float(value) for value in state)
        return self._pin(length, exp(1j * psi), turn, speed, swing, self.part.at(phi).pin)

    def _held(self, drive: float, phi: float, offset: complex) -> Rest:
        """The equilibrium with the pin at `offset`."""

        def at(angle: float) -> tuple[float, Rest]:
            placed = self.part.at(angle)
            axis = placed.pin.value + offset - self.cylinder.pin
            length, psi = abs(axis), phase(axis)
            tension = self.cylinder.k * (length - drive)
            force = self.cylinder.holding(length, psi, tension, self.gravity)
            moment = dot(self.gravity, placed.moments) - dot(force, placed.pin.first)
            return moment, Rest(angle, length, psi, self.part.tip_at(angle), offset, force, tension)

        return at(brentq(lambda angle: at(angle)[0], phi - NEAR, phi + NEAR, xtol=1e-15))[1]

    def _pin(self, length: float, u: complex, turn: float, speed: float, swing: float, bush: Point) -> tuple[complex, complex]:
        rate = (speed + 1j * length * swing) * u - bush.first * turn
        return self.cylinder.pin + length * u - bush.value, rate


MOST = 20_000  # pieces of a motion

Rates = Callable[[float, np.ndarray, float | None], Sequence[float] | np.ndarray]
Gap = Callable[[float, np.ndarray], tuple[float, float]]


def follow(
    rates: Rates, gap: Gap, start: list[float], times: np.ndarray, breaks: Sequence[float], **options: Any
) -> np.ndarray:
    """States (m, n) of a motion with one contact at ascending `times`, cut at every touch, release and break (s).

    `breaks`: where the drive is not smooth. `options` are those of SciPy's solver.

    `rates`: (time, state, approach speed at the last touch or None in flight) -> derivative of the state.
    `gap`: (time, state) -> gap (m, positive in contact) and its rate (m/s).
    """
    stops = [*sorted(t for t in breaks if times[0] < t < times[-1]), times[-1]]
    pieces = list(_pieces(rates, gap, times[0], np.array(start, dtype=float), stops, options))
    which = np.searchsorted([found.t[0] for found in pieces], times, side="right") - 1
    return np.array([pieces[k].sol(time) for k, time in zip(which, times, strict=True)])


def _pieces(
    rates: Rates, gap: Gap, now: float, state: np.ndarray, stops: Sequence[float], options: dict[str, Any]
) -> Iterator[Any]:
    """Solutions between touches, releases and stops."""
    depth, rate = gap(now, state)
    entry = max(rate, 0.0) if depth >= 0.0 else None
    count = 0
    for stop in stops:
        while now < stop:
            event = _crossing(gap, entry is not None)
            found = solve_ivp(rates, (now, stop), state, dense_output=True, events=event, args=(entry,), **options)
            count += 1
            if not found.success or count > MOST:
                raise ArithmeticError(f"t = {found.t[-1]:g} s, after {count} pieces: {found.message}")
            yield found
            now, state = found.t[-1], found.y[:, -1]
            if found.status == 1:
                entry = abs(gap(now, state)[1]) if entry is None else None


def _crossing(gap: Gap, touching: bool) -> Any:
    """Return the event of the gap's change of sign, which ends a piece."""

    def crossing(time: float, state: np.ndarray, entry: float | None) -> float:
        return gap(time, state)[0]

    end = cast(Any, crossing)
    end.terminal, end.direction = True, -1.0 if touching else 1.0
    return end


def _pairs(values: Sequence[complex]) -> np.ndarray:
    both = np.array(values)
    return np.column_stack([both.real, both.imag])


def freed(document: Document, headings: Sequence[float] | np.ndarray, index: int, contact: Contact) -> PinnedBoom:
    """`PinnedBoom` of cylinder `index` (0-based): what lies outboard turns as one body, what lies inboard is ground.

    That cylinder has k, barrel and rod. `headings` (rad) of the sections to the base's x axis.
    """
    joint, places = document["joints"][index], geometry.pivots(document, headings)
    body = geometry.outboard(document, headings, index)
    tip = (places[-1] - places[index]) * exp(-1j * headings[index])
    part: Lever | SixBar
    if index == 0:
        part = Lever(places[0], body, tip, complex(*document["sections"][0]["rod_pin"]))
    else:
        part = SixBar(places[index], body, tip, joint, headings[index - 1])
    cylinder, pin = joint["cylinder"], geometry.pins(document, headings, index)[0]
    barrel, rod = ([p["mass"], p["inertia"], p["com"]] for p in (cylinder["barrel"], cylinder["rod"]))
    oil = OilCylinder(pin, cylinder["k"], cylinder.get("d", 0.0), *barrel, *rod)
    return PinnedBoom(part, oil, contact, geometry.gravity(document))
