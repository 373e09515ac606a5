"""Compile a scene: which operation stands where along the chain, and where its numbers sit in memory.

Only what the scene names gets rows. Section axes: x from the inboard pivot; the head's frame starts where the beam ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any, Literal

import numpy as np

from ..kernels import tables as program
from ..kernels.elements import beam_shapes as modes
from ..kernels.elements import cylinder
from ..kernels.elements import pin_contact as contact
from ..kernels.elements.linkage import LINK_L, LINK_R
from ..kernels.tables import Tables
from ..scene.kinematics import gravity_in_base, linkage
from ..scene.schema import Cylinder, Pin, RigidPart, Scene
from ..scene.segmentation import SAME_PLACE, CylinderPin, cylinder_pins, flexible_parts, splits
from ..types import Array
from .plan import Layout, Plan

BasisName = Literal["end-shapes", "cantilever"]
BASES = {"end-shapes": modes.end_shapes_and_bubbles, "cantilever": modes.cantilever_modes}
# Gauss points beyond the number of shapes: polynomials, or functions that grow exponentially. The error of the quadrature
# then stays below that of leaving out further shapes.
MORE_POINTS = {"end-shapes": 1, "cantilever": 3}
PLACES = {
    "pivot": contact.PIVOT, "link_L": contact.LINK_L_PIN, "link_R": contact.LINK_R_PIN, "Q": contact.Q_PIN,
    "rod": contact.ROD_END_PIN, "barrel": contact.BARREL_END_PIN,
}  # fmt: skip
FINE = 0.1  # increment of an offset, as a share of its clearance, that counts as one of 1 rad


@cache
def _shapes(basis: BasisName, n: int) -> tuple[int, modes.Basis, Array, Array]:
    """Points, shapes, weights and integrals of a part with `n` bending coordinates; many booms share them."""
    points = max(3, n + MORE_POINTS[basis])
    found = BASES[basis](n, points), modes.gauss_points(points)[1], modes.integration_matrix(points)
    for array in (*found[0], *found[1:]):
        array.flags.writeable = False
    return points, *found


def compile_scene(scene: Scene, basis: BasisName = "end-shapes") -> Plan:
    """Compile `scene`; `basis` chooses the bending shapes of all parts (`boom_twin.kernels.elements.beam_shapes`)."""
    builder = _Builder(scene, basis)
    builder.base()
    for index in range(len(scene.sections)):
        builder.joint(index)
        builder.section(index)
    return builder.finish()


class _Builder:
    def __init__(self, scene: Scene, basis: BasisName) -> None:
        self.scene, self.basis, self.layout = scene, basis, Layout()
        self.beam_tables: list[tuple[Array, Array, Array, Array, Array]] = []
        self.outline: list[tuple[int, int]] = []
        self.pins: list[str] = []
        self.scale: list[float] = []
        self.gravity = gravity_in_base(scene)

    def base(self) -> None:
        """Hinge of an elastic base."""
        base = self.scene.base
        if base.stiffness is not None:
            z = self.layout.unknowns(["phi_base"])
            self.scale.append(1.0)
            self.layout.add("hinges", z=z, stiffness=base.stiffness, damping=base.damping or 0.0)

    # -- joints ---------------------------------------------------------------------------------------------------

    def joint(self, index: int) -> None:
        joint, n = self.scene.joints[index], index + 1
        self.layout.add("linkages", **_fields(linkage(self.scene, index)))
        if joint.kind == "A":
            kind, names = program.JOINT_A, ["theta", "N"]
            x, y = self.scene.base.pivot
        else:
            kind, names = program.JOINT_B, ["theta", "alpha_L", "alpha_R", "lambda_x", "lambda_y", "N"]
            x, y = 0.0, 0.0
        self.scale += [0.0 if name in ("N", "lambda_x", "lambda_y") else 1.0 for name in names]
        pins = sorted(self.scene.pins_of(f"joint_{n}"), key=lambda pin: PLACES[pin.at.split(".")[1]])
        z = self.layout.unknowns([f"{name}_{n}" for name in names])
        heavy = {"pivot": True, "Q": bool(joint.mL or joint.mR), "link_L": bool(joint.mL), "link_R": bool(joint.mR)}
        first_clearance = self._clearances(index, pins, heavy)
        first_link = len(self.layout.rows["links"])
        for side, length, mass in ((LINK_L, joint.lL, joint.mL), (LINK_R, joint.lR, joint.mR)):
            if mass and length is not None:
                inertia = mass * length**2 / 12
                history = self._point(mass, inertia)
                self.layout.add("links", side=side, history=history, middle=length / 2, mass=mass, inertia=inertia)
        links = len(self.layout.rows["links"]) - first_link
        row = self.layout.add(
            "joints", z=z, x=x, y=y, first_link=first_link, links=links, first_clearance=first_clearance, clearances=len(pins)
        )
        self._cylinder(n, joint.cylinder, z + len(names) - 1)
        self._mark_frame()
        self.layout.operate(kind, row)

    def _clearances(self, owner: int, pins: Sequence[Pin], heavy: dict[str, bool]) -> int:
        """Rows for `pins`, with the offsets of their journals among the unknowns; returns the first."""
        block, first = self.scene.clearance, len(self.layout.rows["clearances"])
        for pin in pins:
            assert block is not None
            place, law = pin.at.split(".")[1], block.contact
            self.pins.append(pin.at)
            z = self.layout.unknowns([f"{pin.at}.x", f"{pin.at}.y"])
            self.scale += [FINE / pin.radial_clearance] * 2
            softness = sum((1.0 - m.nu**2) / m.E for m in (self.scene.material, law.bush or self.scene.material))
            self.layout.add(
                "clearances",
                z=z,
                owner=owner,
                place=PLACES[place],
                turn=self.layout.histories([0.0], [0.0]) if law.friction else -1,
                heavy=heavy[place],
                linear=block.treatment == "spring-damper",
                gap=pin.radial_clearance,
                stiffness=contact.contact_stiffness(pin.pin_radius, pin.radial_clearance, softness),
                exponent=law.exponent,
                loss=contact.LAWS[law.law](law.restitution),
                friction=law.friction,
                radius=pin.pin_radius,
            )
        return first

    def _cylinder(self, n: int, part: Cylinder, z: int) -> None:
        first_part, pins = len(self.layout.rows["parts"]), self.scene.pins_of(f"cylinder_{n}")
        heavy = {end: own is not None and own.mass > 0.0 for end, own in (("rod", part.rod), ("barrel", part.barrel))}
        for end, own in ((cylinder.BARREL, part.barrel), (cylinder.ROD, part.rod)):
            if own is not None and (own.mass or own.inertia):
                history = self._point(own.mass, own.inertia)
                self.layout.add("parts", end=end, history=history, com=own.com, mass=own.mass, inertia=own.inertia)
        oil = -1 if part.oil is None else self.layout.add("oils", **part.oil_row)
        self.layout.add(
            "cylinders",
            z=z,
            history=self.layout.histories([0.0], [0.0]),
            first_part=first_part,
            parts=len(self.layout.rows["parts"]) - first_part,
            first_clearance=self._clearances(n - 1, pins, heavy),
            clearances=len(pins),
            closed_length=part.closed_length,
            compliance=0.0 if part.k is None else 1.0 / part.k,
            lag=0.0 if part.k is None or part.d is None else part.d / part.k,
            oil=oil,
        )

    # -- sections -------------------------------------------------------------------------------------------------

    def section(self, index: int) -> None:
        """Section `index`: root, flexible parts between pins, head."""
        section, pins = self.scene.sections[index], cylinder_pins(self.scene, index)
        if not self.scene.is_flexible(index):
            self._body(self._rigid_parts(index), 0.0)
            self._stations(pins, 0.0)
            self._offset(section.length)
            return
        assert section.beam is not None
        x0, x1 = section.beam
        self._body(self._with_line(section.root, 0.0, x0), 0.0)
        self._stations([pin for pin in pins if pin.x <= x0 + SAME_PLACE], 0.0)
        self._offset(x0)
        for start, stop in flexible_parts(self.scene, index):
            self._beam(index, stop - start)
            self._stations([pin for pin in splits(self.scene, index) if pin.x == stop], stop)
        self._body(self._with_line(section.head, x1, section.length), x1)
        self._stations([pin for pin in pins if pin.x >= x1 - SAME_PLACE], x1)
        self._offset(section.length - x1)

    def _stations(self, pins: Iterable[CylinderPin], frame: float) -> None:
        for pin in pins:
            kind = program.STATION if pin.cylinder else program.ROD_PIN
            self.layout.operate(kind, self.layout.add("outlets", cylinder=pin.cylinder, x=pin.x - frame, y=pin.y))

    def _offset(self, length: float) -> None:
        if length > SAME_PLACE:
            self._mark_frame()
            self.layout.operate(program.OFFSET, self.layout.add("offsets", x=length, y=0.0))

    def _rigid_parts(self, index: int) -> list[RigidPart]:
        """Everything that moves with a rigid section: its own mass, and its beam's if it has one with no modes."""
        section = self.scene.sections[index]
        parts = [part for part in (section.root, section.head) if part is not None]
        if section.beam is not None and section.rho_A is not None:
            x0, x1 = section.beam
            rod = _rod(section.rho_A, x0, x1)
            turning = (section.rho_I or 0.0) * (x1 - x0)
            parts.append(rod.model_copy(update={"inertia": rod.inertia + turning}))
        return parts + self._with_line(None, 0.0, section.length)

    def _with_line(self, part: RigidPart | None, x0: float, x1: float) -> list[RigidPart]:
        parts = [] if part is None else [part]
        if self.scene.line_fill and x1 - x0 > SAME_PLACE:
            parts.append(_rod(self.scene.line_fill, x0, x1))
        return parts

    def _body(self, parts: list[RigidPart], frame: float) -> None:
        """One body for all `parts` that ride on the same frame; nothing if they have no mass."""
        mass = sum(part.mass for part in parts)
        inertia = sum(part.inertia for part in parts)
        if mass == 0.0 and inertia == 0.0:
            return
        x = sum(part.mass * part.com[0] for part in parts) / mass if mass else 0.0
        y = sum(part.mass * part.com[1] for part in parts) / mass if mass else 0.0
        inertia += sum(part.mass * ((part.com[0] - x) ** 2 + (part.com[1] - y) ** 2) for part in parts)
        history = self._point(mass, inertia)
        row = self.layout.add("bodies", history=history, x=x - frame, y=y, mass=mass, inertia=inertia)
        self.layout.operate(program.BODY, row)

    def _beam(self, index: int, length: float) -> None:
        section, n = self.scene.sections[index], self.scene.of_section(index, "modes")
        assert section.A is not None and section.I is not None and section.rho_A is not None
        points, basis, share, integrals = _shapes(self.basis, n)
        mass = (section.rho_A + (self.scene.line_fill or 0.0)) * length * share
        turning = (section.rho_I or 0.0) * length * share
        elastic = self.scene.material.E
        part = len(self.beam_tables) + 1
        axial = self.scene.of_section(index, "axial")
        z = self.layout.unknowns([f"q{k + 1}_part{part}" for k in range(n)] + [f"eps_part{part}"] * axial)
        self.scale += [1.0] * n + [length] * axial
        history = self.layout.histories([m for m in mass for _ in range(2)], [m * g for m in mass for g in self.gravity])
        if section.rho_I:
            self.layout.histories(list(turning), [0.0] * points)
        row = self.layout.add(
            "beams",
            z=z,
            bending=n,
            axial=axial,
            points=points,
            finite=points if self.scene.of_section(index, "geometric") else 0,
            rotary=points if section.rho_I else 0,
            damped=n + axial if section.beta else 0,
            history=history,
            beta=section.beta or 0.0,
            axial_stiffness=elastic * section.A * length,
        )
        stiffness = modes.bending_stiffness(basis, elastic * section.I, length)
        self.beam_tables.append((basis.psi, integrals * length, stiffness, mass, turning))
        self._mark_frame()
        self.outline += [(1, history + 2 * k) for k in range(points)]
        self.layout.operate(program.BEAM, row)

    # -- bookkeeping ----------------------------------------------------------------------------------------------

    def _point(self, mass: float, inertia: float) -> int:
        return self.layout.histories([mass, mass, inertia], [mass * self.gravity[0], mass * self.gravity[1], 0.0])

    def _mark_frame(self) -> None:
        self.outline.append((0, len(self.layout.rows["operations"])))

    def finish(self) -> Plan:
        """Payload, tip, and everything as arrays."""
        layout, scene = self.layout, self.scene
        if scene.tip is not None and scene.tip.payload:
            self._body([RigidPart(mass=scene.tip.payload, com=(0.0, 0.0), inertia=0.0)], 0.0)
        tip = layout.histories([0.0, 0.0, 0.0], [0.0, 0.0, 0.0])
        self._mark_frame()
        unknowns = len(layout.names)
        arrays: dict[str, Any] = {name: layout.table(name) for name in layout.rows} | _stacked(self.beam_tables)
        tables = Tables(
            **arrays,
            gravity=self.gravity,
            moving=np.array([0.0 if scale == 0.0 else 1.0 for scale in self.scale]),
            scale=np.array(self.scale),
            tip=unknowns + tip,
        )
        shift = np.array([(kind, place + unknowns * kind) for kind, place in self.outline], dtype=np.int64)
        zeros = [0.0] * unknowns
        closed = np.array([joint.cylinder.closed_length for joint in scene.joints])
        return Plan(
            tables, tuple(layout.names), np.array(zeros + layout.masses), np.array(zeros + layout.weights), shift, closed,
            tuple(self.pins),
        )  # fmt: skip


def _rod(mass_per_length: float, x0: float, x1: float) -> RigidPart:
    mass = mass_per_length * (x1 - x0)
    return RigidPart(mass=mass, com=((x0 + x1) / 2, 0.0), inertia=mass * (x1 - x0) ** 2 / 12)


def _fields(row: np.record) -> dict[str, float]:
    return {name: row[name] for name in row.dtype.names or ()}


def _stacked(parts: list[tuple[Array, Array, Array, Array, Array]]) -> dict[str, Array]:
    """Tables of all beam parts, padded to the largest: psi, weights, stiffness, point_mass, point_rotary."""
    names = ("psi", "weights", "stiffness", "point_mass", "point_rotary")
    dimensions = (2, 2, 2, 1, 1)
    stacked = {}
    for i, name in enumerate(names):
        shape = np.max([part[i].shape for part in parts], axis=0) if parts else np.zeros(dimensions[i], int)
        block = np.zeros((len(parts), *shape))
        for k, part in enumerate(parts):
            block[k][tuple(slice(size) for size in part[i].shape)] = part[i]
        stacked[name] = block
    return stacked
