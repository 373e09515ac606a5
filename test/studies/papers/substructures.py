"""Transfer matrices of substructures A, B1, B2, B3, assembled from those of the elements, and their product.

A, by the papers' equations (3) to (5) [Z]: U_1 is the root up to the rod pin P, U_c the cylinder's branch, U_o what lies
outboard,

    Z_O = U_o (U_1 Z_I1 + E1 U_c Z_I2),     E2 U_1 Z_I1 = E2 U_c Z_I2,     E3 U_c Z_I2 = 0.

E1 lets the branch add its forces, E2 takes the rows x and y, E3 the row M. (In lines 2 and 3 of equation (5) the vectors are
printed as output vectors; they have to be the inputs.)

B reaches from the cut before its barrel pin C to the cut before the next one. Of its six-bar eight unknowns are eliminated, the
force in pin C (2), the angle of the cylinder, the force in pin D (2), the angles of link L, link R and the turned section, by
eight equations: no torque in four pins, two pins that meet.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from boom_twin.compiler.plan import Plan
from boom_twin.errors import UsageError
from boom_twin.kernels.elements.linkage import LINK_L
from boom_twin.kernels.tables import BEAM, BODY, JOINT_B, OFFSET, ROD_PIN, STATION, Z_LINK_L, Z_LINK_R, Z_SECTION, State

from .element_matrices import (
    QX,
    Step,
    Vector,
    affine,
    beam,
    body,
    condensed,
    cylinder,
    give,
    jacobian,
    offset,
    turned,
)

E1 = np.diag([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0])
E2 = np.eye(7)[:2]
E3 = np.eye(7)[3:4]


@dataclass(frozen=True)
class Substructure:
    """One of the chain.

    Attributes
    ----------
    name : str
        ``A``, ``B1``, ``B2`` or ``B3``, and the number of its section.
    first, last : int
        Operations that it consists of, the last one not included.
    matrix : ndarray, shape (7, 7)
        Overall transfer matrix.
    inlet, outlet : ndarray, shape (6,)
        State vectors that it was made at.
    """

    name: str
    first: int
    last: int
    matrix: np.ndarray
    inlet: np.ndarray
    outlet: np.ndarray


def substructures(scene_kinds: Sequence[str], plan: Plan, state: State, step: Step, forces: np.ndarray) -> list[Substructure]:
    """The whole chain, A first.

    Parameters
    ----------
    scene_kinds : sequence of str
        Kinds of the joints, ``A`` first.
    state : State
        That the step has solved for.
    forces : ndarray, shape (operations + 1, 3)
        Force (N) and torque (N m) at every cut with nothing carried: qx, qy, M.

    Raises
    ------
    UsageError
        Clearance, or two cylinders that overlap on a section.
    """
    kinds = plan.tables.operations.kind
    pins = [int(k) for k in np.flatnonzero((kinds == STATION) | (kinds == ROD_PIN) | (kinds == JOINT_B))]
    expected = [ROD_PIN, *([STATION, JOINT_B] * (plan.joints - 1))]
    if plan.pins or [int(kinds[k]) for k in pins] != expected:
        raise UsageError("the papers' substructures stand one behind the other, with ideal pins: give such a scene.")
    starts = [*pins[1::2], len(kinds)]
    chain = [_first(state, step, pins[0], starts[0], forces)]
    for kind, start, joint, stop in zip(scene_kinds[1:], starts[:-1], pins[2::2], starts[1:], strict=True):
        chain.append(_later(kind, state, step, (start, joint, stop), forces))
    return chain


def _vector(state: State, forces: np.ndarray, cut: int) -> np.ndarray:
    """State vector (6,) at a cut."""
    qx, qy, moment = forces[cut]
    return np.array([*state.frames[cut, :3], moment, qx, qy])


Element = tuple[Callable[[Vector, Vector], tuple[Vector, Vector]], np.ndarray]
"""Map of an element, (Z_I, q) -> (Z_O, residual), and its inner unknowns q."""


def _element(state: State, step: Step, operation: int) -> Element:
    """Body, offset or beam."""
    t = step.tables
    kind, row = int(t.operations[operation].kind), int(t.operations[operation].row)
    if kind == BEAM:
        part = t.beams[row]
        return lambda z, q: beam(step, row, z, q), state.z[part.z : part.z + part.bending + part.axial]
    if kind == BODY:
        own = t.bodies[row]
        return lambda z, q: (body(step, z, own.mass, own.inertia, (own.x, own.y), own.history), q), np.zeros(0)
    assert kind == OFFSET
    place = (float(t.offsets[row].x), float(t.offsets[row].y))
    return lambda z, q: (offset(z, place), q), np.zeros(0)


def _elements(state: State, step: Step, operations: range, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Product (7, 7) of the transfer matrices of bodies, offsets and beams, and the vector behind them."""
    product = np.eye(7)
    for k in operations:
        element, q = _element(state, step, k)
        product, z = condensed(element, z, q) @ product, np.real(element(z, q)[0])
    return product, z


def _behind(state: State, step: Step, operations: range, z: Vector) -> Vector:
    """The vector behind bodies, offsets and beams that stay bent as they are: linear in the forces of `z`."""
    for k in operations:
        element, q = _element(state, step, k)
        z = element(z, q)[0]
    return z


def _solved(function: Callable[[Vector], Vector], guess: np.ndarray) -> np.ndarray:
    """Zero of a map that is all but linear in what is looked for."""
    for _ in range(3):
        guess = guess - np.linalg.solve(jacobian(function, guess), np.real(function(guess.astype(complex))))
    return guess


def _first(state: State, step: Step, rod: int, stop: int, forces: np.ndarray) -> Substructure:
    """Substructure A: root, cylinder, and section 1 up to the next pin C."""
    t, place = step.tables, None
    outlet, base = t.outlets[t.operations[rod].row], t.linkages[0]
    place = (float(outlet.x), float(outlet.y))
    barrel = np.array([t.joints[0].x + base.cx, t.joints[0].y + base.cy])
    axis = state.pins[0, 2:] - state.pins[0, :2]
    angle = float(np.arctan2(axis[1], axis[0]))

    def branch(z: Vector) -> Vector:
        return cylinder(step, 0, z)

    def rod_end(force: Vector) -> Vector:
        end = branch(np.array([*barrel, angle, 0.0, *force]))
        return np.array([end[3], (end[0] - state.pins[0, 2]) * axis[0] + (end[1] - state.pins[0, 3]) * axis[1]])

    second = np.array([*barrel, angle, 0.0, *_solved(rod_end, np.zeros(2))])
    u_c = affine(branch, second)
    pushed = np.real(branch(second.astype(complex)))[QX:]
    behind = _vector(state, forces, rod + 1)
    before = np.real(give(behind.astype(complex), place, pushed))  # without what the cylinder gives
    root, first = _root(state, step, rod, before)
    u_1 = affine(lambda z: offset(z, place), before) @ root
    back = affine(lambda z: offset(z, (-place[0], -place[1])), np.real(offset(behind.astype(complex), place)))
    outer, last = _elements(state, step, range(rod + 1, stop), behind)
    u_o = outer @ back
    # of Z_I2 the place of pin C and M = 0 are known: its angle and force follow from the loop
    known = np.array([0, 1, 3, 6])
    loop = np.vstack([E2 @ u_c, E3 @ u_c])
    given = np.append(second, 1.0)[known]
    gains = np.linalg.solve(loop[:, [2, 4, 5]], np.vstack([E2 @ u_1, np.zeros((1, 7))]))
    still = -np.linalg.solve(loop[:, [2, 4, 5]], loop[:, known] @ given)
    second_of_first = np.zeros((7, 7))
    second_of_first[[2, 4, 5]] = gains
    second_of_first[[2, 4, 5], 6] += still
    second_of_first[known, 6] += given
    matrix = u_o @ (u_1 + E1 @ u_c @ second_of_first)
    return Substructure("A", 1, stop, matrix, first, last)


def _root(state: State, step: Step, rod: int, before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Product of what lies between the base pivot and the rod pin's frame, and the vector at the pivot."""

    def end(force: Vector) -> Vector:
        return _behind(state, step, range(1, rod), np.array([*state.frames[1, :3], *force]))[3:] - before[3:]

    first = np.append(state.frames[1, :3], _solved(end, np.zeros(3)))
    return _elements(state, step, range(1, rod), first)[0], first


def _later(kind: str, state: State, step: Step, cuts: tuple[int, int, int], forces: np.ndarray) -> Substructure:
    """Substructure B: from the cut before pin C, over the six-bar, to the next cut."""
    start, joint, stop = cuts
    t = step.tables
    outlet, index = t.outlets[t.operations[start].row], int(t.operations[joint].row)
    bracket, own = (float(outlet.x), float(outlet.y)), t.joints[index]
    inlet = _vector(state, forces, start)
    axis = state.pins[index, 2:] - state.pins[index, :2]
    z = state.z[own.z :]
    angles = (np.arctan2(axis[1], axis[0]), z[Z_LINK_L], z[Z_LINK_R], z[Z_SECTION])

    def loop(inlet: Vector, u: Vector, main: Callable[[Vector], Vector]) -> tuple[Vector, Vector]:
        return _six_bar(step, index, bracket, inlet, u, main)

    def exact(z: Vector) -> Vector:
        return _behind(state, step, range(start + 1, joint), z)

    def balance(force: Vector) -> Vector:
        u = np.array([force[0], force[1], angles[0], force[2], force[3], *angles[1:]])
        return loop(inlet, u, exact)[1][:4]

    force = _solved(balance, np.zeros(4))
    inner = np.array([force[0], force[1], angles[0], force[2], force[3], *angles[1:]])
    given = np.real(give(inlet.astype(complex), bracket, inner[:2]))
    product, _ = _elements(state, step, range(start + 1, joint), given)

    def linear(z: Vector) -> Vector:
        return product[:6, :6] @ z + product[:6, 6]

    u_loop = condensed(lambda z, u: loop(z, u, linear), inlet, inner)
    behind = (u_loop @ np.append(inlet, 1.0))[:6]
    outer, last = _elements(state, step, range(joint + 1, stop), behind)
    return Substructure(f"{kind} of section {index + 1}", start, stop, outer @ u_loop, inlet, last)


def _six_bar(
    step: Step, index: int, bracket: tuple[float, float], inlet: Vector, u: Vector, main: Callable[[Vector], Vector]
) -> tuple[Vector, Vector]:
    """Vector at the pivot on the turned section, and the eight residuals; `main`: from pin C's frame to the head's pivot."""
    t = step.tables
    linkage, joint = t.linkages[index], t.joints[index]
    force_c, angle, force_d, left, right, section = u[:2], u[2], u[3:5], u[5], u[6], u[7]
    pin = offset(inlet, bracket)
    rod = cylinder(step, index, np.array([pin[0], pin[1], angle, 0.0 * angle, force_c[0], force_c[1]]))
    head = main(give(inlet, bracket, force_c))
    d = (float(linkage.dx), float(linkage.dy))
    foot = offset(head, d)
    pivot = give(head, d, force_d)
    z_left = _link(step, joint, 0, np.array([foot[0], foot[1], left, 0.0 * left, *force_d]), 0.0)
    is_left, place = linkage.mount == LINK_L, np.array([float(linkage.along), float(linkage.left)])
    length = float(linkage.length_r)
    if is_left:
        held = z_left[:2] + turned(left, place)
        z_left = give(z_left, place, -rod[QX:])
    q = offset(z_left, (float(linkage.length_l), 0.0))
    z_right = _link(step, joint, 1, np.array([q[0], q[1], right, 0.0 * right, q[QX], q[QX + 1]]), -length)
    if not is_left:
        place = place - np.array([length, 0.0])
        held = z_right[:2] + turned(right, place)
        z_right = give(z_right, place, -rod[QX:])
    end = offset(z_right, (-length, 0.0))
    e = (float(linkage.ex), float(linkage.ey))
    z = np.array([pivot[0], pivot[1], section, 0.0 * section, pivot[QX], pivot[QX + 1]])
    meeting = z[:2] + turned(section, e)
    out = give(z, e, -end[QX:])
    return out, np.array([rod[3], q[3], end[3], pivot[3], *(rod[:2] - held), *(end[:2] - meeting)])


def _link(step: Step, joint: np.record, side: int, z: Vector, shift: float) -> Vector:
    """Mass of link L (side 0) or R, if it has any; `shift`: of its own origin from the vector's place, along it (m)."""
    t = step.tables
    for k in range(joint.first_link, joint.first_link + joint.links):
        row = t.links[k]
        if row.side == LINK_L + side:
            z = body(step, z, row.mass, row.inertia, (row.middle + shift, 0.0), row.history)
    return z
