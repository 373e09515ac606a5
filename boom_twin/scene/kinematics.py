"""Rigid kinematics of the undeformed boom: joint angles, strokes, passive link angles and the place of every pin.

A URDF is a tree, a six-bar is not. Its links and cylinders hang in the tree by one pin each, and the positions of these
pins close the loops.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import NamedTuple, cast

import numpy as np

from ..errors import UsageError
from ..kernels.elements.linkage import DIRECT, LINK_L, LINK_R, LINKAGE, angles_of_lengths, cylinder_length, link_angles
from ..kernels.plane_algebra import turned
from ..types import Array
from .schema import Base, JointGeometry, Scene, Section

RANGE_SAMPLES = 721  # angles of a joint's range at which it is examined
_RECORD = np.dtype((np.record, LINKAGE))
MARGIN = math.radians(1.0)  # beyond range_deg: strokes at the ends, with their sensors' noise, still have an angle


def linkage(scene: Scene, index: int) -> np.record:
    """Return the geometry of joint `index` (0-based) as one record of `LINKAGE`."""
    return linkage_of(scene.joints[index], scene.base, scene.sections[0])


def linkage_of(joint: JointGeometry, base: Base | None, first: Section | None) -> np.record:
    """Return the geometry of a joint from its parts; kind A needs the base and the first section, the others neither."""
    row = np.zeros(1, _RECORD)
    if joint.kind == "A":
        pin, pivot = base.cylinder_pin, base.pivot  # type: ignore[union-attr]
        row["mount"] = DIRECT
        row["cx"], row["cy"] = pin[0] - pivot[0], pin[1] - pivot[1]
        row["ex"], row["ey"] = first.rod_pin  # type: ignore[misc, union-attr]  # validated: A has a rod_pin
        return cast(np.record, row[0])
    row["cx"], row["cy"] = joint.C  # type: ignore[misc]  # validated: B has C, D, E, lL, lR
    row["dx"], row["dy"] = joint.D  # type: ignore[misc]
    row["ex"], row["ey"] = joint.E  # type: ignore[misc]
    row["length_l"], row["length_r"], row["side"] = joint.lL, joint.lR, -1.0 if joint.side == "right" else 1.0
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
    """Return strokes (m) of joint `index` at relative `angles` (rad), shape as `angles`; NaN where the links do not close."""
    with np.errstate(invalid="ignore"):
        lengths, _ = cylinder_length(plain(linkage(scene, index)), np.atleast_1d(angles))
    return np.asarray(lengths - scene.joints[index].cylinder.closed_length)


class JointCurve(NamedTuple):
    """A joint over its angles; NaN where the links do not meet."""

    lengths: Array  # of the cylinder, pin to pin, m
    levers: Array  # size of ds/dphi, m
    between: Array  # angle of the links at Q, 0 (a dead centre) to 90 deg; 90 for kind A


def joint_curve(record: np.record, angles: Array) -> JointCurve:
    """Return the curve of a joint at `angles` (rad)."""
    row = plain(record)
    with np.errstate(invalid="ignore"):
        lengths, slopes = cylinder_length(row, angles)
        if row.mount == DIRECT:
            return JointCurve(lengths, np.abs(slopes), np.full(np.shape(angles), 90.0))
        left, right = link_angles(row, angles)
        return JointCurve(lengths, np.abs(slopes), np.degrees(np.abs(np.arcsin(np.sin(left - right)))))


def stroke_range(scene: Scene, index: int, samples: int) -> tuple[float, float]:
    """Return the least and greatest stroke (m) of joint `index` at `samples` angles of its range, within the cylinder's travel.

    The least is above the greatest where the range and the travel have nothing in common.
    """
    joint = scene.joints[index]
    strokes = stroke_curve(scene, index, np.radians(np.linspace(*joint.range_deg, samples)))
    return max(float(np.nanmin(strokes)), 0.0), min(float(np.nanmax(strokes)), joint.cylinder.max_stroke)


def section_angles(scene: Scene, posture: str) -> tuple[float, ...]:
    """Return the section angles to the base (deg) of a posture: a name of the scene, or the angles themselves: ``90,-23,-23``.

    UsageError if there is no such name, or a joint cannot take its angle.
    """
    if posture in scene.postures:
        return scene.postures[posture]
    try:
        angles = tuple(float(part) for part in posture.strip("[] ").split(","))
    except ValueError:
        known = ", ".join(scene.postures) or "no posture"
        remedy = "Choose one of these, or give the angle of every section to the horizontal, deg: 60,20,-30."
        raise UsageError(f"posture = {posture!r}: the scene has {known}. {remedy}") from None
    if len(angles) != len(scene.joints):
        raise UsageError(f"posture = {posture!r}: {len(angles)} of {len(scene.joints)} section angles. Give one for each.")
    for i, (joint, angle) in enumerate(zip(scene.joints, np.diff(angles, prepend=0.0).tolist(), strict=True)):
        low, high = joint.range_deg
        if not low - math.degrees(MARGIN) <= angle <= high + math.degrees(MARGIN):
            told = f"turns joint {i + 1} to {angle:g} deg, outside its range_deg {low:g} to {high:g}"
            raise UsageError(f"posture = {posture!r}: {told}. A joint angle is the difference of neighbouring section angles.")
    return angles


def posture_angles(scene: Scene, posture: str) -> Array:
    """Return the relative joint angles (rad), shape (n,), of the undeformed boom in a posture, see `section_angles`."""
    return np.diff(np.radians(section_angles(scene, posture)), prepend=0.0)


def strokes_of_posture(scene: Scene, posture: str) -> Array:
    """Return the strokes (m), shape (n,), that bring the undeformed boom to a posture, see `section_angles`."""
    return strokes_of_angles(scene, posture_angles(scene, posture))


def strokes_of_angles(scene: Scene, relative: Array) -> Array:
    """Return the strokes (m), shape (n,), of the undeformed boom at `relative` joint angles (rad); NaN if links are open."""
    return np.array([stroke_curve(scene, i, relative[i : i + 1])[0] for i in range(len(scene.joints))])


def joint_angles_of_strokes(scene: Scene, strokes: Array, near: Array | None = None, name: str = "stroke") -> Array:
    """Return relative angles (rad), shape (n,), of the undeformed boom at absolute `strokes` (m), called by `name` in errors.

    Where a stroke belongs to two angles, the one next to `near` (rad), shape (n,), if given. UsageError if a stroke is not
    reached anywhere in its joint's ``range_deg``, widened by one degree.
    """
    return RigidJoints(scene).angles(strokes, near, name)


class RigidJoints:
    """Joints of the undeformed boom, for many calls of `joint_angles_of_strokes`."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._rows = scene, np.zeros(len(scene.joints), LINKAGE).view(np.recarray)
        for i in range(len(self._rows)):
            self._rows[i] = linkage(scene, i)
        ranges = np.radians([joint.range_deg for joint in scene.joints])
        self._low, self._high = ranges[:, 0] - MARGIN, ranges[:, 1] + MARGIN
        self._closed = np.array([joint.cylinder.closed_length for joint in scene.joints])

    def angles(self, strokes: Array, near: Array | None = None, name: str = "stroke") -> Array:
        """See `joint_angles_of_strokes`."""
        rows, start_samples = self._rows, 181  # angles at which that of a stroke is looked for first
        angles, near = np.empty(len(rows)), np.full(len(rows), math.nan) if near is None else np.ascontiguousarray(near, float)
        angles_of_lengths(rows, self._closed + strokes, near, self._low, self._high, start_samples, angles)
        for i in np.flatnonzero(~np.isfinite(angles)).tolist():
            curve = stroke_curve(self._scene, i, np.linspace(self._low[i], self._high[i], start_samples))
            raise UsageError(
                f"{name}_{i + 1} = {float(strokes[i]):.6g} m: joint {i + 1} reaches {np.nanmin(curve):.6g} to "
                f"{np.nanmax(curve):.6g} m in its range_deg {self._scene.joints[i].range_deg}. Give a {name} inside."
            )
        return angles


def gravity_in_base(scene: Scene) -> Array:
    """Return gravity (m/s^2), shape (2,), in the axes of the base, which an inclination turns."""
    gx, gy = scene.gravity
    c, s = math.cos(scene.base.inclination), math.sin(scene.base.inclination)
    return np.array([c * gx + s * gy, c * gy - s * gx])


CYLINDER, LEFT, RIGHT = "cylinder_{}_swivel", "link_l_{}_swivel", "link_r_{}_swivel"


class PassiveJoints:
    """Positions of the passive joints of one scene.

    `names` are ``cylinder_1_swivel``, then of every six-bar i ``cylinder_i_swivel``, ``link_l_i_swivel``,
    ``link_r_i_swivel``.
    """

    def __init__(self, scene: Scene) -> None:
        self._joints = [(joint.kind, plain(linkage(scene, i))) for i, joint in enumerate(scene.joints)]
        kinds = [(CYLINDER,) if kind == "A" else (CYLINDER, LEFT, RIGHT) for kind, _ in self._joints]
        self.names = tuple(name.format(i) for i, own in enumerate(kinds, start=1) for name in own)

    def positions(self, angles: Array) -> Array:
        """Return the angles (rad, from -pi to pi) in the order of `names`, at relative joint `angles` (rad), shape (.., n).

        A barrel and link L are measured in the section before (the base for joint 1), link R in its own section. NaN where
        the links do not close.
        """
        found = []
        for (kind, row), phi in zip(self._joints, np.ascontiguousarray(np.moveaxis(angles, -1, 0)), strict=True):
            pins = _pins_at(kind, row, phi)
            found.append(np.angle(pins[rod_pin_of(pins)] - pins[barrel_pin_of(pins)]))
            if "Q" in pins:
                found += [np.angle(pins["Q"] - pins["D"]), np.angle((pins["Q"] - pins["E"]) * np.exp(-1j * phi))]
        return np.stack(found, axis=-1)


def plain(row: np.record) -> SimpleNamespace:
    """Return the fields of a record as Python numbers, which cost a tenth to read."""
    return SimpleNamespace(**dict(zip(LINKAGE.names or (), row.item(), strict=True)))


@dataclass(frozen=True)
class JointPins:
    """Pins of one joint in the model frame, m, each shape (2,), by the names of `joint_pins`."""

    kind: str
    named: dict[str, Array]

    @property
    def barrel_pin(self) -> Array:
        """Pin of the cylinder's barrel."""
        return self.named[barrel_pin_of(self.named)]

    @property
    def rod_pin(self) -> Array:
        """Pin of the cylinder's rod."""
        return self.named[rod_pin_of(self.named)]

    @property
    def links(self) -> list[list[Array]]:
        """Corners of link L and of link R; three where the rod pin is on that link beside its ends."""
        if self.kind == "A":
            return []
        left, right = ([self.named[end], self.named["Q"]] for end in "DE")
        if self.kind != "B1":
            (left if self.kind == "B2" else right).append(self.named["R"])
        return [left, right]


@dataclass(frozen=True)
class Skeleton:
    """An undeformed boom of n sections."""

    headings: Array  # orientation of every section, rad, shape (n,)
    pivots: Array  # inboard pivots, then the tip, m, shape (n + 1, 2)
    joints: tuple[JointPins, ...]

    def point(self, section: int, x: float, y: float = 0.0) -> Array:
        """Return a point given in the axes of `section` (0-based), m, in the model frame, shape (2,)."""
        return np.asarray(self.pivots[section] + np.array(turned(float(self.headings[section]), x, y)))


def rigid_chain(pivot: Array, lengths: Array, angles: Array) -> tuple[Array, Array]:
    """Return headings (.., n) in rad, pivots and tip (.., n + 1, 2) in m, of rigid sections at relative joint `angles` (rad).

    `angles` have shape (.., n); the first `pivot` (2,) in m; `lengths` (n,) of the sections, m.
    """
    headings = np.cumsum(angles, axis=-1)
    steps = lengths[:, None] * np.stack([np.cos(headings), np.sin(headings)], axis=-1)
    return headings, pivot + np.concatenate([np.zeros_like(steps[..., :1, :]), np.cumsum(steps, axis=-2)], axis=-2)


def skeleton(scene: Scene, angles: Array) -> Skeleton:
    """Return the pins of the undeformed boom at relative joint `angles` (rad), shape (n,)."""
    headings, pivots = rigid_chain(np.array(scene.base.pivot), np.array([s.length for s in scene.sections]), angles)
    joints = tuple(_pins(scene, i, pivots[i], headings) for i in range(len(headings)))
    return Skeleton(headings, pivots, joints)


def _pins(scene: Scene, i: int, pivot: Array, headings: Array) -> JointPins:
    carrier = float(headings[i - 1]) if i else 0.0
    found, turn = joint_pins(scene, i, np.array(float(headings[i]) - carrier)), np.exp(1j * carrier)
    pins = {name: pivot + np.array([(turn * pin).real, (turn * pin).imag]) for name, pin in found.items()}
    return JointPins(scene.joints[i].kind, pins)


def joint_pins(scene: Scene, i: int, phi: Array) -> dict[str, Array]:
    """Return the pins of joint `i` (0-based) by name at angles `phi` (rad), as x + iy (m) from the pivot in its carrier's axes.

    The rod pin is ``Q`` in kind B1, ``R`` in the other six-bars, ``rod_pin`` in kind A. NaN where the links do not meet.
    """
    return _pins_at(scene.joints[i].kind, plain(linkage(scene, i)), phi)


def _pins_at(kind: str, row: SimpleNamespace, phi: Array) -> dict[str, Array]:
    e = np.asarray(_complex(turned(phi, row.ex, row.ey)))
    pins = {"the pivot": np.zeros_like(e), "cylinder_pin" if kind == "A" else "C": np.full_like(e, complex(row.cx, row.cy))}
    if kind == "A":
        return pins | {"rod_pin": e}
    with np.errstate(invalid="ignore"):
        left, right = link_angles(row, phi)
    d = complex(row.dx, row.dy)
    pins |= {"D": np.full_like(e, d), "E": e, "Q": np.asarray(d + row.length_l * np.exp(1j * left))}
    if kind != "B1":
        base, angle = (d, left) if row.mount == LINK_L else (e, right)
        pins["R"] = np.asarray(base + _complex(turned(angle, row.along, row.left)))
    return pins


def barrel_pin_of(pins: dict[str, Array]) -> str:
    """Return the name of the pin of a joint that holds the barrel."""
    return "C" if "C" in pins else "cylinder_pin"


def rod_pin_of(pins: dict[str, Array]) -> str:
    """Return the name of the pin of a joint that holds the rod."""
    return next(name for name in ("R", "Q", "rod_pin") if name in pins)


def _complex(point: tuple[Array, Array]) -> Array:
    return np.asarray(point[0] + 1j * point[1])
