"""The rigid boom of a scene's file: pins, cylinder lengths, levers; what lies outboard of a joint as one body.

`document` is a scene's file as plain dicts; headings (rad) are those of the sections to the base's x axis; 0-based.
"""

from __future__ import annotations

from cmath import exp
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...records import Array
from .linkage import links, on_left, on_right, rod_pin
from .moving import Document, Mass, lumped

Headings = Sequence[float] | Array
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
    """Pin to pin, m."""
    barrel, rod = pins(document, headings, index)
    return abs(rod - barrel)


def levers(document: Document, headings: Headings, step: float = 1e-5) -> Complexes:
    """How the tip moves per metre of each cylinder, the others held: complex, shape (n,), by central differences.

    To first order this times (clearance + penetration) is the tip's shift by the play of a pin that lies on its side: a
    pulled cylinder acts as if longer by that, a pushed one as if shorter.
    """
    found = []
    for index in range(len(headings)):
        turned = [np.array(headings, dtype=float) for _ in range(2)]
        turned[0][index:] -= step
        turned[1][index:] += step
        tips = [pivots(document, h)[-1] for h in turned]
        lengths = [cylinder_length(document, h, index) for h in turned]
        found.append((tips[1] - tips[0]) / (lengths[1] - lengths[0]))
    return np.array(found)


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
    """In the base's axes, complex, m/s^2."""
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
