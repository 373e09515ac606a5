"""Check that a cylinder stays clear of the pins of its joint and of its carrier section, over the range of the joint.

A cylinder lies amid the section, where the pivot's pin and those of the links pass through. Its barrel is taken as thick as its
bore and two walls, its rod as thick as it is, a pin as half the bore. Only `oil` gives them: a cylinder with `k` is not judged.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ...config.yaml_text import Place
from ...types import Array
from ..linkage_range import PIN, distances_to, joint_pins, rod_pin_of
from ..schema import Cylinder, Oil, Scene
from .draft import Draft, Finding, warning
from .joint_range import Mask, grid_of, usable

WALL = 0.12  # of a barrel, over its bore
BARREL = 0.9  # of the closed length; the rest is the rod's end and its eye


class Pass(NamedTuple):
    """A pin that a cylinder passes: its name, and at each angle the distance (m), what is needed, and whether of the barrel."""

    pin: str
    distance: Array
    needed: Array
    at_barrel: Mask


def clear_cylinders(draft: Draft, scene: Scene) -> Iterator[Finding]:
    """All cylinders that have `oil`; of each the pin that is closest against what it needs."""
    for i, joint in enumerate(scene.joints):
        if joint.cylinder.oil is not None:
            degrees = grid_of(joint)
            passes = list(passes_of(scene, i, joint.cylinder, joint.cylinder.oil, np.radians(degrees)))
            worst = min(passes, key=lambda each: float(np.nanmin(each.distance / each.needed)), default=None)
            if worst is not None and np.nanmin(worst.distance / worst.needed) < 1.0:
                clear = np.all([each.distance >= each.needed for each in passes], axis=0)
                yield _finding(draft, scene, i, worst, degrees, clear)


def _finding(draft: Draft, scene: Scene, i: int, worst: Pass, degrees: Array, clear: Array) -> Finding:
    at = int(np.nanargmin(worst.distance / worst.needed))
    part, size = ("barrel", "half the barrel") if worst.at_barrel[at] else ("rod", "half the rod")
    bound = (
        f"at {degrees[at]:.0f} deg the {part} of cylinder {i + 1} passes {worst.distance[at]:.3f} m from {worst.pin}, where a "
        f"boom has a pin; expected at least {worst.needed[at]:.3f} m, {size} and half a pin of half the bore"
    )
    pins = "C, D, E or the lengths of the links" if i else "cylinder_pin or rod_pin"
    low, high = usable(degrees, np.where(clear, degrees, np.nan))
    narrower = f", or narrow range_deg to [{low:g}, {high:g}]" if low < high else ""
    place: Place = ("joints", i, "C") if i else ("base", "cylinder_pin")
    value = scene.joints[i].C if i else scene.base.cylinder_pin
    return warning(draft, place, value, bound, f"Look at `check --picture`; move {pins}{narrower}.")


def passes_of(scene: Scene, i: int, cylinder: Cylinder, oil: Oil, phi: Array) -> Iterator[Pass]:
    """The pins beside the cylinder's own two, in the axes of its carrier, as complex numbers x + iy, m."""
    pins = joint_pins(scene, i, phi)
    foot, rod_pin = pins.pop("C" if i else "cylinder_pin"), pins.pop(rod_pin_of(pins))
    length = np.abs(rod_pin - foot)
    for name, pin in (pins | _pins_before(scene, i, pins["the pivot"])).items():
        distance, place = distances_to(pin, foot, rod_pin)
        at_barrel = place * length < BARREL * cylinder.closed_length
        radius = np.where(at_barrel, (0.5 + WALL) * oil.bore, 0.5 * oil.rod)
        yield Pass(name, distance, radius + 0.5 * PIN * oil.bore, at_barrel)


def _pins_before(scene: Scene, i: int, pivot: Array) -> dict[str, Array]:
    """Pins at the inboard end of the carrier of joint `i`, each shape as `pivot`."""
    if i == 0:
        return {}
    carrier, before = scene.sections[i - 1], scene.joints[i - 1]
    inner = carrier.rod_pin if i == 1 else before.E
    found = {"the pivot before": pivot - carrier.length}
    if inner is not None:
        found["rod_pin of section 1" if i == 1 else "E of the joint before"] = np.asarray(
            pivot + (complex(*inner) - carrier.length)
        )
    return found
