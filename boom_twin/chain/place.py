"""Positions from coordinates, base to tip: exact kinematics, so that the tree is closed at every iterate."""

from __future__ import annotations

import math

from ..physics.beam import USUAL, Sizes, beam_shape, is_usual, place_beam
from ..physics.cylinder import place_cylinder
from ..physics.jit import inner, kernel
from ..physics.linkage import LINK_L
from ..physics.rotation import rotated
from .program import BEAM, BODY, JOINT_A, JOINT_B, OFFSET, ROD_PIN, STATION


@inner
def link_frame(side, linkage, turns):
    """Pin on the body (from the pivot), and cosine and sine, of link L (pin D on the head) or R (pin E on the section)."""
    if side == LINK_L:
        x, y = rotated(turns[0], turns[1], linkage.dx, linkage.dy)
        return x, y, turns[4], turns[5]
    x, y = rotated(turns[2], turns[3], linkage.ex, linkage.ey)
    return x, y, turns[6], turns[7]


@inner
def place_linkage(t, state, work, index, x, y, c, s):
    """Links and cylinder of joint B `index` (row of all joint tables), whose pivot is (x, y) on a head turned by (c, s)."""
    joint, linkage, z, turns = t.joints[index], t.linkages[index], state.z, state.turns[index]
    turns[0], turns[1] = c, s
    for k in range(3):
        turns[2 + 2 * k], turns[3 + 2 * k] = math.cos(z[joint.z + k]), math.sin(z[joint.z + k])
    for k in range(joint.first_link, joint.first_link + joint.links):
        link = t.links[k]
        bx, by, cl, sl = link_frame(link.side, linkage, turns)
        work.position[link.history] = x + bx + link.middle * cl
        work.position[link.history + 1] = y + by + link.middle * sl
        work.position[link.history + 2] = z[joint.z + 1 + (link.side != LINK_L)]
    bx, by, cl, sl = link_frame(linkage.mount, linkage, turns)
    wx, wy = rotated(cl, sl, linkage.along, linkage.left)
    pins = state.pins[index]
    pins[2], pins[3] = x + bx + wx, y + by + wy
    place_cylinder(t.cylinders[index], t.parts, pins[0], pins[1], pins[2], pins[3], work.position)


@kernel
def place(t, state, work):
    """Frames, pins and all positions from the unknowns `state.z`."""
    z, frames, position = state.z, state.frames, work.position
    for i in range(z.shape[0]):
        position[i] = z[i]
    x, y, theta, c, s = 0.0, 0.0, 0.0, 1.0, 0.0
    for k in range(t.operations.shape[0]):
        kind, row = t.operations[k].kind, t.operations[k].row
        frames[k, 0], frames[k, 1], frames[k, 2], frames[k, 3], frames[k, 4] = x, y, theta, c, s
        if kind == BEAM:
            beam, rho = t.beams[row], work.rho[row]
            if is_usual(beam):
                end = beam_shape(beam, USUAL, t.psi[row], t.weights[row], z, rho, work.drho[row], work.angles, work.turn[row])
                place_beam(beam, USUAL, rho, work.angles, x, y, theta, c, s, position)
            else:
                sizes = Sizes(beam.bending, beam.axial, beam.points)
                end = beam_shape(beam, sizes, t.psi[row], t.weights[row], z, rho, work.drho[row], work.angles, work.turn[row])
                place_beam(beam, sizes, rho, work.angles, x, y, theta, c, s, position)
            bx, by = rho[beam.points, 0], rho[beam.points, 1]
            x, y, theta = x + c * bx - s * by, y + s * bx + c * by, theta + end
            c, s = math.cos(theta), math.sin(theta)
        elif kind == BODY:
            body = t.bodies[row]
            at = body.history
            position[at], position[at + 1] = x + c * body.x - s * body.y, y + s * body.x + c * body.y
            position[at + 2] = theta
        elif kind == OFFSET:
            bx, by = t.offsets[row].x, t.offsets[row].y
            x, y = x + c * bx - s * by, y + s * bx + c * by
        elif kind == STATION:
            outlet = t.outlets[row]
            pins = state.pins[outlet.cylinder]
            pins[0], pins[1] = x + c * outlet.x - s * outlet.y, y + s * outlet.x + c * outlet.y
        elif kind == ROD_PIN:
            outlet = t.outlets[row]
            pins = state.pins[outlet.cylinder]
            pins[2], pins[3] = x + c * outlet.x - s * outlet.y, y + s * outlet.x + c * outlet.y
            place_cylinder(t.cylinders[0], t.parts, pins[0], pins[1], pins[2], pins[3], position)
        elif kind == JOINT_B:
            place_linkage(t, state, work, row, x, y, c, s)
            theta, c, s = z[t.joints[row].z], state.turns[row, 2], state.turns[row, 3]
        elif kind == JOINT_A:
            x, y, theta = t.joints[row].x, t.joints[row].y, z[t.joints[row].z]
            c, s = math.cos(theta), math.sin(theta)
    last = t.operations.shape[0]
    frames[last, 0], frames[last, 1], frames[last, 2], frames[last, 3], frames[last, 4] = x, y, theta, c, s
    position[t.tip], position[t.tip + 1], position[t.tip + 2] = x, y, theta
