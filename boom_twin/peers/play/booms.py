"""One joint of a scene's boom set free, all else rigid and held: its cylinder with play in the rod pin."""

from __future__ import annotations

from cmath import exp
from collections.abc import Sequence

from ...records import Array
from . import geometry
from .contact import Contact
from .cylinder import Cylinder
from .moving import Document
from .parts import Lever, SixBar
from .pinned_boom import PinnedBoom


def freed(document: Document, headings: Sequence[float] | Array, index: int, contact: Contact | None) -> PinnedBoom:
    """`PinnedBoom` of cylinder `index` (0-based): what lies outboard turns as one body, what lies inboard is ground.

    Parameters
    ----------
    document : dict
        A scene's file; that cylinder has k, barrel and rod.
    headings : sequence of float
        rad, of the sections to the base's x axis.
    contact : Contact or None
        None: an ideal pin, for equilibria only.
    """
    joint, places = document["joints"][index], geometry.pivots(document, headings)
    body = geometry.outboard(document, headings, index)
    tip = (places[-1] - places[index]) * exp(-1j * headings[index])
    part: Lever | SixBar
    if index == 0:
        part = Lever(places[0], body, complex(*document["sections"][0]["rod_pin"]), tip)
    else:
        part = SixBar(places[index], body, joint, headings[index - 1], tip)
    cylinder, pin = joint["cylinder"], geometry.pins(document, headings, index)[0]
    barrel, rod = ([p["mass"], p["inertia"], p["com"]] for p in (cylinder["barrel"], cylinder["rod"]))
    oil = Cylinder(pin, cylinder["k"], cylinder.get("d", 0.0), *barrel, *rod)
    return PinnedBoom(part, oil, contact, geometry.gravity(document))
