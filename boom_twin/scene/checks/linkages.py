"""A joint over its range: its pins, what stands between them, how far it is from dead centres, what runs over the pivot."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..kernels.elements.linkage import LINK_L, cylinder_length, link_angles
from ..kernels.plane_algebra import turned
from ..types import Array
from .kinematics import linkage, transmission_angles
from .schema import Scene, section_depth

PIN = 0.5  # diameter of a pin over the bore
BORE = 0.4  # of a cylinder without `oil`, over the depth of the section that turns
STEPS = 721  # angles of a range


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
    over_pivot: tuple[str, ...]
    """What runs over the pivot's pin, with the angle where it is in the middle of it: ``link L at -142 deg``."""


def linkage_account(scene: Scene, i: int) -> LinkageAccount:
    """Return what joint `i` (0-based) of a scene does over its range."""
    row, degrees = linkage(scene, i), np.linspace(*scene.joints[i].range_deg, STEPS)
    pins = joint_pins(scene, i, np.radians(degrees))
    with np.errstate(invalid="ignore"):
        levers = np.abs(cylinder_length(row, np.radians(degrees))[1])
    between = float(np.degrees(np.nanmin(transmission_angles(row, np.radians(degrees))))) if i else None
    lever = float(np.nanmin(levers)), float(np.nanmax(levers))
    return LinkageAccount(lever, between, nearest_pins(pins, degrees), _over_pivot(scene, i, pins, degrees))


def pin_diameter(scene: Scene, i: int) -> float:
    """Return the assumed diameter (m) of the pins of joint `i` (0-based): half the bore, which is guessed without `oil`."""
    oil = scene.joints[i].cylinder.oil
    return PIN * (BORE * section_depth(scene, i) if oil is None else oil.bore)


def joint_pins(scene: Scene, i: int, phi: Array) -> dict[str, Array]:
    """Return the pins of joint `i` (0-based) by name at angles `phi` (rad), as x + iy (m) from the pivot in its carrier's axes.

    The rod pin is ``Q`` in kind B1, ``R`` in the other six-bars, ``rod_pin`` in kind A. NaN where the links do not meet.
    """
    row = linkage(scene, i)
    e = np.asarray(_complex(turned(phi, row.ex, row.ey)))
    pins = {"the pivot": np.zeros_like(e), "C" if i else "cylinder_pin": np.full_like(e, complex(row.cx, row.cy))}
    if i == 0:
        return pins | {"rod_pin": e}
    with np.errstate(invalid="ignore"):
        left, right = link_angles(row, phi)
    d = complex(row.dx, row.dy)
    pins |= {"D": np.full_like(e, d), "E": e, "Q": np.asarray(d + row.length_l * np.exp(1j * left))}
    if scene.joints[i].kind != "B1":
        base, angle = (d, left) if row.mount == LINK_L else (e, right)
        pins["R"] = np.asarray(base + _complex(turned(angle, row.along, row.left)))
    return pins


def rod_pin_of(pins: dict[str, Array]) -> str:
    """Return the name of the pin of a joint that holds the rod."""
    return next(name for name in ("R", "Q", "rod_pin") if name in pins)


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


def _over_pivot(scene: Scene, i: int, pins: dict[str, Array], degrees: Array) -> tuple[str, ...]:
    rod = rod_pin_of(pins)
    lines = {"cylinder": ("C" if i else "cylinder_pin", rod)}
    if i:
        lines |= {"link L": ("D", "Q"), "link R": ("E", "Q")}
    found = []
    for name, (start, end) in lines.items():
        distance, _ = distances_to(pins["the pivot"], pins[start], pins[end])
        at = int(np.nanargmin(distance))
        if distance[at] < 0.5 * pin_diameter(scene, i):
            found.append(f"{name} at {degrees[at]:.0f} deg")
    return tuple(found)


def _complex(point: tuple[Array, Array]) -> Array:
    return np.asarray(point[0] + 1j * point[1])
