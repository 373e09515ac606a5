"""Equilibrium of a boom part on a cylinder with play, found from the force to the place.

With the pin held at an offset, one equation in the heading is left: the oil, as long as it then is, must carry the part. Its
force tells on which side of the bush the pin really lies and how deep. The offset hardly changes the force, so that a few
passes suffice.
"""

from __future__ import annotations

from cmath import phase
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scipy.optimize import brentq

from .moving import dot

if TYPE_CHECKING:
    from .pinned_boom import PinnedBoom

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


def equilibrium(boom: PinnedBoom, drive: float, phi: float) -> Rest:
    """`Rest` of a `PinnedBoom` at a length of the drive (m), within `NEAR` of heading `phi` (rad)."""
    offset = 0j
    for _ in range(PASSES):
        rest = _held(boom, drive, phi, offset)
        found = 0j if boom.contact is None else boom.contact.resting_offset(-rest.force)
        if abs(found - offset) < SAME:
            return rest
        offset = found
    raise ArithmeticError(f"no side to lie on at {drive:g} m near {phi:g} rad: the pin bears {abs(rest.force):g} N")


def _held(boom: PinnedBoom, drive: float, phi: float, offset: complex) -> Rest:
    """With the pin at `offset`."""

    def at(angle: float) -> tuple[float, Rest]:
        placed = boom.part.at(angle)
        axis = placed.pin.value + offset - boom.cylinder.pin
        length, psi = abs(axis), phase(axis)
        tension = boom.cylinder.k * (length - drive)
        force = boom.cylinder.holding(length, psi, tension, boom.gravity)
        moment = dot(boom.gravity, placed.moments) - dot(force, placed.pin.first)
        return moment, Rest(angle, length, psi, boom.part.tip_at(angle), offset, force, tension)

    return at(brentq(lambda angle: at(angle)[0], phi - NEAR, phi + NEAR, xtol=1e-15))[1]
