"""Check that the pins of a six-bar keep clear of each other over the range of the joint.

A pin goes through the whole width of the boom, so two of them need room beside each other in whatever planes the links lie. A
link may run over the pivot, for it lies beside the section. In most six-bars that turn 165 degrees it does.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..linkage_range import BORE, PIN, joint_pins, nearest_pins, pin_diameter
from ..schema import Scene
from .draft import Draft, Finding, warning
from .joint_range import grid_of, usable

ROOM = 1.25  # between the centres of two pins, over the diameter: a quarter of it is left for the eyes around them


def spaced_pins(draft: Draft, scene: Scene) -> Iterator[Finding]:
    """Yield a warning for each six-bar whose two closest pins have less room than they need."""
    for i, joint in enumerate(scene.joints):
        degrees = grid_of(joint)
        pins, needed = joint_pins(scene, i, np.radians(degrees)), ROOM * pin_diameter(scene, i)
        nearest = nearest_pins(pins, degrees)
        if nearest is None or nearest.distance >= needed:
            continue
        apart = np.abs(pins[nearest.first] - pins[nearest.second])
        low, high = usable(degrees, np.where(apart >= needed, degrees, np.nan))
        narrower = f", or narrow range_deg to [{low:g}, {high:g}]" if low < high else ""
        oil = joint.cylinder.oil
        bore = "the bore" if oil else f"a bore guessed as {BORE:g} of the depth of the section"
        bound = (
            f"at {nearest.degrees:.0f} deg {nearest.first} and {nearest.second} are {nearest.distance:.3f} m apart; "
            f"expected at least {needed:.3f} m, pins {pin_diameter(scene, i):.3f} m thick ({PIN:g} of {bore}) with their eyes"
        )
        key = next((name for name in ("R", "E", "D", "C") if name in (nearest.first, nearest.second)), "lL")
        remedy = f"Look at `check --picture`; move C, D, E or R, or change lL or lR{narrower}."
        yield warning(draft, ("joints", i, key), getattr(joint, key), bound, remedy)
