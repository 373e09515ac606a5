"""Pins and cylinder of a joint over its range: levers, angle of the links, nearest pins, pins in the way of a cylinder.

A cylinder lies amid the section, where the pivot's pin and those of the links pass through. Its barrel is taken as thick as its
bore and two walls, its rod as thick as it is, a pin as half the bore. Only `oil` gives them: a cylinder with `k` is not judged.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ...config.yaml_text import Place
from ...errors import Fault
from ...types import Array
from ..kinematics import RANGE_SAMPLES, joint_curve, joint_pins, linkage, rod_pin_of
from ..schema import Cylinder, Oil, Scene
from . import Draft, Findings
from .geometry import Mask, grid_of, usable

PIN = 0.5  # diameter of a pin over the bore
WALL = 0.12  # of a barrel, over its bore
BARREL = 0.9  # of the closed length; the rest is the rod's end and its eye


@dataclass(frozen=True)
class Nearest:
    """Two pins where they come closest: their names, the distance (m) and the joint's angle (deg)."""

    first: str
    second: str
    distance: float
    degrees: float


@dataclass(frozen=True)
class LinkageAccount:
    """A joint over its range."""

    lever: tuple[float, float]
    """Least and greatest ds/dphi, m."""
    transmission_deg: float | None
    """Least angle between the links; None for kind A."""
    nearest: Nearest | None
    """Nearest of the pins that move against each other; None for kind A."""


def linkage_account(scene: Scene, i: int) -> LinkageAccount:
    """Return what joint `i` (0-based) of a scene does over its range."""
    row, degrees = linkage(scene, i), np.linspace(*scene.joints[i].range_deg, RANGE_SAMPLES)
    pins = joint_pins(scene, i, np.radians(degrees))
    _, levers, between = joint_curve(row, np.radians(degrees))
    lever, least = (float(np.nanmin(levers)), float(np.nanmax(levers))), float(np.nanmin(between)) if i else None
    return LinkageAccount(lever, least, nearest_pins(pins, degrees))


def nearest_pins(pins: dict[str, Array], degrees: Array) -> Nearest | None:
    """Return the two pins of a six-bar that come closest; None for kind A, whose pins are its measures."""
    if "Q" not in pins:
        return None
    found = []
    for first, second in combinations(pins, 2):
        distance = np.abs(pins[first] - pins[second])
        at = int(np.nanargmin(distance))
        found.append(Nearest(first, second, float(distance[at]), float(degrees[at])))
    return min(found, key=lambda each: each.distance)


def distances_to(point: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """Return the distance (m) of points from the line between two others, and where on it (0 to 1) that is; all x + iy."""
    along = end - start
    place = np.clip(((point - start) * along.conj()).real / np.abs(along) ** 2, 0.0, 1.0)
    return np.abs(point - start - place * along), place


class Pass(NamedTuple):
    """A pin that a cylinder passes: its name, and at each angle the distance (m), what is needed, and whether of the barrel."""

    pin: str
    distance: Array
    needed: Array
    at_barrel: Mask


def clear_cylinders(draft: Draft) -> Findings:
    """Check all cylinders that have `oil`; of each the pin that is closest against what it needs."""
    scene = draft.scene
    for i, joint in enumerate(scene.joints):
        if joint.cylinder.oil is not None:
            degrees = grid_of(joint)
            passes = list(passes_of(scene, i, joint.cylinder, joint.cylinder.oil, np.radians(degrees)))
            worst = min(passes, key=lambda each: float(np.nanmin(each.distance / each.needed)), default=None)
            if worst is not None and np.nanmin(worst.distance / worst.needed) < 1.0:
                clear = np.all([each.distance >= each.needed for each in passes], axis=0)
                yield _finding(draft, scene, i, worst, degrees, clear)


def _finding(draft: Draft, scene: Scene, i: int, worst: Pass, degrees: Array, clear: Array) -> Fault:
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
    return draft.warning(place, value, bound, f"Look at `check --picture`; move {pins}{narrower}.")


def passes_of(scene: Scene, i: int, cylinder: Cylinder, oil: Oil, phi: Array) -> Iterator[Pass]:
    """Return the pins beside the cylinder's own two, in the axes of its carrier, as complex numbers x + iy, m."""
    pins = joint_pins(scene, i, phi)
    foot, rod_pin = pins.pop("C" if i else "cylinder_pin"), pins.pop(rod_pin_of(pins))
    length = np.abs(rod_pin - foot)
    for name, pin in (pins | _pins_before(scene, i, pins["the pivot"])).items():
        distance, place = distances_to(pin, foot, rod_pin)
        at_barrel = place * length < BARREL * cylinder.closed_length
        radius = np.where(at_barrel, (0.5 + WALL) * oil.bore, 0.5 * oil.rod)
        yield Pass(name, distance, radius + 0.5 * PIN * oil.bore, at_barrel)


def _pins_before(scene: Scene, i: int, pivot: Array) -> dict[str, Array]:
    """Return the pins at the inboard end of the carrier of joint `i`, each shape as `pivot`."""
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
