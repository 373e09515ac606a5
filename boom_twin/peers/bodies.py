"""Links, barrels and rods of the finite-segment boom: what they weigh, where their centres and the rod pins lie."""

from __future__ import annotations

import numpy as np

from ..scene.parts import CylinderPart, Joint, Scene


class Bodies:
    """Of a scene: first all links L, then all links R, barrels, rods.

    Attributes
    ----------
    mass, inertia : ndarray, shape (2 (n - 1) + 2 n,)
        kg, kg m^2.
    left_middle, right_middle : ndarray, shape (n - 1,)
        Centre of a link, m along it from its own pin.
    barrel, rod : ndarray, shape (n,)
        Centre of barrel and rod, m from their pins.
    on_left : list of bool
        Whether the rod is pinned to link L.
    rod_ahead, rod_aside : ndarray, shape (n - 1,)
        Where, m along and to the left of that link.
    """

    def __init__(self, scene: Scene) -> None:
        six_bars, cylinders = scene.joints[1:], [joint.cylinder for joint in scene.joints]
        self.left_middle = np.array([0.5 * (joint.lL or 0.0) for joint in six_bars])
        self.right_middle = np.array([0.5 * (joint.lR or 0.0) for joint in six_bars])
        self.on_left = [joint.kind != "B3" for joint in six_bars]
        self.rod_ahead, self.rod_aside = np.array([_rod_pin(joint) for joint in six_bars]).reshape(-1, 2).T
        barrels = [_cylinder_part(cylinder.barrel) for cylinder in cylinders]
        rods = [_cylinder_part(cylinder.rod) for cylinder in cylinders]
        self.barrel, self.rod = np.array([part[2] for part in barrels]), np.array([part[2] for part in rods])
        links = [(joint.mL or 0.0, (joint.mL or 0.0) * (joint.lL or 0.0) ** 2 / 12) for joint in six_bars]
        links += [(joint.mR or 0.0, (joint.mR or 0.0) * (joint.lR or 0.0) ** 2 / 12) for joint in six_bars]
        self.mass, self.inertia = np.array([*links, *(part[:2] for part in (*barrels, *rods))]).T


def _rod_pin(joint: Joint) -> tuple[float, float]:
    """On link L from D (B1, B2), or on link R from E (B3), in m along and to the left."""
    along, aside = joint.R or (0.0, 0.0)
    if joint.kind == "B1":
        return joint.lL or 0.0, 0.0
    return (along, aside) if joint.kind == "B2" else ((joint.lR or 0.0) - along, -aside)


def _cylinder_part(part: CylinderPart | None) -> tuple[float, float, float]:
    """Mass, inertia, distance of the centre from the pin; a part that is not there weighs nothing."""
    return (0.0, 0.0, 0.0) if part is None else (part.mass, part.inertia, part.com)
