"""Geometry of the reference boom with a worn pin: pins, cylinder lengths, link angles with derivatives.

Axes of the head before, origin in the pivot. With a = lL e^(i L), b = lR e^(i R), e = E e^(i phi):

D + a = e + b ,      a L' - b R' = e ,      a L'' - b R'' = i (e - a L'^2 + b R'^2) .

`document` is a scene's file as plain dicts; headings (rad) are those of the sections to the base's x axis; 0-based.
"""

from __future__ import annotations

from cmath import exp, phase
from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

Document = dict[str, Any]  # a scene's file, or a part of it


@dataclass(frozen=True)
class Mass:
    """A rigid body in some axes: kg, kg m^2 about its centre, the centre (complex, m)."""

    mass: float
    inertia: float
    at: complex


@dataclass(frozen=True, slots=True)
class Point:
    """A place (m) and its derivatives by the angle."""

    value: complex
    first: complex
    second: complex

    def __add__(self, other: Point) -> Point:
        return Point(self.value + other.value, self.first + other.first, self.second + other.second)

    def seen_from(self, origin: complex, heading: float) -> Point:
        """Return this point in axes in which its own stand at `origin`, turned by `heading`."""
        turn = exp(1j * heading)
        return Point(origin + turn * self.value, turn * self.first, turn * self.second)


@dataclass(frozen=True, slots=True)
class Turn:
    """A heading (rad) and its derivatives by the angle."""

    value: float
    first: float
    second: float

    def arm(self, local: complex) -> Point:
        """The vector `local` (complex, m) carried by this heading."""
        arm = local * exp(1j * self.value)
        return Point(arm, 1j * self.first * arm, (1j * self.second - self.first**2) * arm)


def lumped(masses: Sequence[Mass]) -> Mass:
    """One rigid body of many that do not move against each other."""
    mass = sum(body.mass for body in masses)
    at = sum(body.mass * body.at for body in masses) / mass
    return Mass(mass, sum(body.inertia + body.mass * abs(body.at - at) ** 2 for body in masses), at)


def dot(a: complex, b: complex) -> float:
    """Scalar product of two vectors of the plane."""
    return a.real * b.real + a.imag * b.imag


def links(joint: Document, phi: float) -> tuple[Turn, Turn]:
    """Headings of links L and R (`Turn`) at a joint angle phi; `joint` as in a scene's file."""
    d, e, long, short = complex(*joint["D"]), complex(*joint["E"]) * exp(1j * phi), joint["lL"], joint["lR"]
    gap = e - d
    along = (abs(gap) ** 2 + long**2 - short**2) / (2.0 * abs(gap))
    height = sqrt(long**2 - along**2)
    a = complex(along, -height if joint.get("side") == "right" else height) * gap / abs(gap)
    b = a - gap
    first = _solved(a, b, e)
    second = _solved(a, b, 1j * (e - a * first[0] ** 2 + b * first[1] ** 2))
    return Turn(phase(a), first[0], second[0]), Turn(phase(b), first[1], second[1])


def rod_pin(joint: Document, phi: float, left: Turn, right: Turn) -> Point:
    """Return the rod pin, a `Point` over phi, given the links there."""
    if joint["kind"] == "B3":
        return on_right(joint, phi, right, joint["lR"] - complex(*joint["R"]))
    return on_left(joint, left, complex(*joint["R"]) if joint["kind"] == "B2" else joint["lL"])


def on_left(joint: Document, left: Turn, local: complex) -> Point:
    """A point carried by link L, `local` from D along and to the left of it."""
    return Point(complex(*joint["D"]), 0j, 0j) + left.arm(local)


def on_right(joint: Document, phi: float, right: Turn, local: complex) -> Point:
    """A point carried by link R, `local` from E along and to the left of it."""
    return Turn(phi, 1.0, 0.0).arm(complex(*joint["E"])) + right.arm(local)


def _solved(a: complex, b: complex, wanted: complex) -> tuple[float, float]:
    """Real x, y with a x - b y = wanted."""
    area = (b.conjugate() * a).imag
    return (b.conjugate() * wanted).imag / area, (a.conjugate() * wanted).imag / area


Headings = Sequence[float] | np.ndarray
Complexes = NDArray[np.complex128]


def pivots(document: Document, headings: Headings) -> Complexes:
    """Pivots of all sections and, last, the tip; complex, m."""
    steps = [s["length"] * exp(1j * h) for s, h in zip(document["sections"], headings, strict=True)]
    return np.asarray(complex(*document["base"]["pivot"]) + np.concatenate([[0.0], np.cumsum(steps)]))


def pins(document: Document, headings: Headings, index: int) -> tuple[complex, complex]:
    """Barrel pin and rod pin of cylinder `index`, complex, m."""
    pivot, joint = pivots(document, headings)[index], document["joints"][index]
    if index == 0:
        rod = pivot + complex(*document["sections"][0]["rod_pin"]) * exp(1j * headings[0])
        return complex(*document["base"]["cylinder_pin"]), rod
    before = headings[index - 1]
    phi = headings[index] - before
    rod = rod_pin(joint, phi, *links(joint, phi)).seen_from(pivot, before).value
    return pivot + complex(*joint["C"]) * exp(1j * before), rod


def cylinder_length(document: Document, headings: Headings, index: int) -> float:
    """Return the length of cylinder `index`, pin to pin, m."""
    barrel, rod = pins(document, headings, index)
    return abs(rod - barrel)


def outboard(document: Document, headings: Headings, index: int) -> Mass:
    """All that turns with section `index` as one body, in that section's axes; without the links of its own joint."""
    places = pivots(document, headings)
    masses: list[Mass] = []
    for i in range(index, len(headings)):
        masses += _turned(_section(document, i), places[i], headings[i])
        if i > index:
            masses += _joint(document, headings, i, places[i])
    masses.append(Mass(document.get("tip", {}).get("payload", 0.0), 0.0, places[-1]))
    return lumped(_turned(masses, -places[index], 0.0, -headings[index]))


def gravity(document: Document) -> complex:
    """Return gravity in the base's axes, complex, m/s^2."""
    return complex(*document["gravity"]) * exp(-1j * document["base"].get("inclination", 0.0))


def _turned(masses: Sequence[Mass], origin: complex, heading: float, after: float = 0.0) -> list[Mass]:
    turn, all_over = exp(1j * heading), exp(1j * after)
    return [Mass(body.mass, body.inertia, (origin + turn * body.at) * all_over) for body in masses]


def _section(document: Document, index: int) -> list[Mass]:
    """Rigid parts, the beam as a rod, the filled line."""
    section = document["sections"][index]
    found = [Mass(p["mass"], p["inertia"], complex(*p["com"])) for p in (section.get("root"), section.get("head")) if p]
    if "beam" in section:
        x0, x1 = section["beam"]
        found.append(_rod(section["rho_A"], x0, x1, section.get("rho_I", 0.0)))
    return [*found, _rod(document.get("line_fill", 0.0), 0.0, section["length"], 0.0)]


def _rod(per_metre: float, x0: float, x1: float, turning_per_metre: float) -> Mass:
    long = x1 - x0
    return Mass(per_metre * long, per_metre * long**3 / 12.0 + turning_per_metre * long, complex(0.5 * (x0 + x1)))


def _joint(document: Document, headings: Headings, index: int, pivot: complex) -> list[Mass]:
    """Links, barrel and rod of a six-bar."""
    joint, before = document["joints"][index], headings[index - 1]
    phi = headings[index] - before
    left, right = links(joint, phi)
    both = (
        (joint.get("mL", 0.0), joint["lL"], on_left(joint, left, 0.5 * joint["lL"])),
        (joint.get("mR", 0.0), joint["lR"], on_right(joint, phi, right, 0.5 * joint["lR"])),
    )
    found = [Mass(m, m * long**2 / 12.0, middle.seen_from(pivot, before).value) for m, long, middle in both]
    barrel, rod = pins(document, headings, index)
    axis = (rod - barrel) / abs(rod - barrel)
    for name, pin, inwards in (("barrel", barrel, axis), ("rod", rod, -axis)):
        part = joint["cylinder"].get(name)
        if part:
            found.append(Mass(part["mass"], part["inertia"], pin + part["com"] * inwards))
    return found
