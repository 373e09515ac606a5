"""Rigid kinematics of a scene: postures, joint angles and strokes of the undeformed boom."""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from ..errors import UsageError
from ..physics.linkage import DIRECT, LINK_L, LINK_R, LINKAGE, angle_of_length, cylinder_length
from ..records import Array
from .parts import Base, Joint, Scene, Section

MARGIN = math.radians(1.0)  # beyond range_deg: strokes at the ends, with their sensors' noise, still have an angle


def linkage(scene: Scene, index: int) -> np.record:
    """Geometry of joint `index` (0-based) as one record of `LINKAGE`."""
    return linkage_of(scene.joints[index], scene.base, scene.sections[0])


def linkage_of(joint: Joint, base: Base | None, first: Section | None) -> np.record:
    """Geometry of a joint from its parts; kind A needs the base and the first section, the others neither."""
    row = np.zeros(1, LINKAGE).view(np.recarray)
    if joint.kind == "A":
        pin, pivot = base.cylinder_pin, base.pivot  # type: ignore[union-attr]
        row["mount"] = DIRECT
        row["cx"], row["cy"] = pin[0] - pivot[0], pin[1] - pivot[1]
        row["ex"], row["ey"] = first.rod_pin  # type: ignore[misc, union-attr]  # validated: A has a rod_pin
        return cast(np.record, row[0])
    row["cx"], row["cy"] = joint.C  # type: ignore[misc]  # validated: B has C, D, E, lL, lR
    row["dx"], row["dy"] = joint.D  # type: ignore[misc]
    row["ex"], row["ey"] = joint.E  # type: ignore[misc]
    row["length_l"], row["length_r"] = joint.lL, joint.lR
    if joint.kind == "B1":
        row["mount"], row["along"] = LINK_L, joint.lL
    elif joint.kind == "B2":
        row["mount"] = LINK_L
        row["along"], row["left"] = joint.R  # type: ignore[misc]
    else:
        row["mount"] = LINK_R
        row["along"], row["left"] = joint.lR - joint.R[0], -joint.R[1]  # type: ignore[index, operator]
    return cast(np.record, row[0])


def stroke_curve(scene: Scene, index: int, angles: Array) -> Array:
    """Strokes (m) of joint `index` at relative `angles` (rad), shape as `angles`; NaN where the links do not close."""
    row, closed = linkage(scene, index), scene.joints[index].cylinder.closed_length
    with np.errstate(invalid="ignore"):
        return np.asarray(cylinder_length(row, np.atleast_1d(angles))[0] - closed)


def posture_angles(scene: Scene, name: str) -> Array:
    """Relative joint angles (rad), shape (n,), of the undeformed boom in a named posture."""
    if name not in scene.postures:
        known = ", ".join(scene.postures) or "none"
        raise UsageError(f"posture = {name!r}: the scene has {known}. Choose one of these or give the strokes.")
    return np.diff(np.radians(scene.postures[name]), prepend=0.0)


def strokes_of_posture(scene: Scene, name: str) -> Array:
    """Strokes (m), shape (n,), that bring the undeformed boom to a named posture."""
    relative = posture_angles(scene, name)
    return np.array([stroke_curve(scene, i, relative[i : i + 1])[0] for i in range(len(scene.joints))])


def joint_angles_of_strokes(scene: Scene, strokes: Array, near: Array | None = None, samples: int = 181) -> Array:
    """Relative angles (rad), shape (n,), of the undeformed boom at absolute `strokes` (m).

    Where a stroke belongs to two angles, the one next to `near` (rad), shape (n,), if given.

    Raises
    ------
    UsageError
        If a stroke is not reached anywhere in its joint's ``range_deg``, widened by one degree.
    """
    angles = np.empty(len(scene.joints))
    for i, stroke in enumerate(strokes):
        low, high = np.radians(scene.joints[i].range_deg) + np.array([-MARGIN, MARGIN])
        row, length = linkage(scene, i), scene.joints[i].cylinder.closed_length + float(stroke)
        grid = np.linspace(low, high, samples)
        curve = stroke_curve(scene, i, grid)
        start = near[i] if near is not None else grid[int(np.nanargmin(np.abs(curve - stroke)))]
        angles[i] = angle_of_length(row, length, start, low, high)
        if not math.isfinite(angles[i]):
            raise UsageError(
                f"stroke_{i + 1} = {stroke:.6g} m: joint {i + 1} reaches {np.nanmin(curve):.6g} to "
                f"{np.nanmax(curve):.6g} m in its range_deg {scene.joints[i].range_deg}. Give a stroke inside."
            )
    return angles


def gravity_in_base(scene: Scene) -> Array:
    """Gravity (m/s^2), shape (2,), in the axes of the base, which an inclination turns."""
    gx, gy = scene.gravity
    c, s = math.cos(scene.base.inclination), math.sin(scene.base.inclination)
    return np.array([c * gx + s * gy, c * gy - s * gx])
