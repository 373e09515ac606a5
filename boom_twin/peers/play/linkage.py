"""The two links of a six-bar, from where their circles meet; their turning rates from the closure's derivatives.

Axes of the head before, origin in the pivot. With a = lL e^(i L), b = lR e^(i R), e = E e^(i phi):

    D + a = e + b ,      a L' - b R' = e ,      a L'' - b R'' = i (e - a L'^2 + b R'^2) .
"""

from __future__ import annotations

from cmath import exp, phase
from math import sqrt

from .moving import Document, Point, Turn


def links(joint: Document, phi: float) -> tuple[Turn, Turn]:
    """Headings of links L and R (`Turn`) at a joint angle phi; `joint` as in a scene's file. Pin Q is left of D->E."""
    d, e, long, short = complex(*joint["D"]), complex(*joint["E"]) * exp(1j * phi), joint["lL"], joint["lR"]
    gap = e - d
    along = (abs(gap) ** 2 + long**2 - short**2) / (2.0 * abs(gap))
    a = complex(along, sqrt(long**2 - along**2)) * gap / abs(gap)
    b = a - gap
    first = _solved(a, b, e)
    second = _solved(a, b, 1j * (e - a * first[0] ** 2 + b * first[1] ** 2))
    return Turn(phase(a), first[0], second[0]), Turn(phase(b), first[1], second[1])


def rod_pin(joint: Document, phi: float, left: Turn, right: Turn) -> Point:
    """Where the rod is pinned, a `Point` over phi, given the links there."""
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
