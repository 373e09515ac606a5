"""Positions from coordinates, base to tip: exact kinematics, so that the tree is closed at every iterate."""

from __future__ import annotations

import math

from ..physics.beam import beam_shape, place_beam
from ..physics.cylinder import place_cylinder
from ..physics.jit import inner, kernel
from ..physics.linkage import LINK_L
from ..physics.rigid import turned_by
from .program import BEAM, BODY, JOINT_A, JOINT_B, OFFSET, ROD_PIN, STATION


@inner
def link_frame(side, joint, linkage, z, head, theta):
    """Pin on the body (from the pivot) and angle of link L (pin D on the head) or R (pin E on the section)."""
    if side == LINK_L:
        x, y = turned_by(head, linkage.dx, linkage.dy)
        return x, y, z[joint.z + 1]
    x, y = turned_by(theta, linkage.ex, linkage.ey)
    return x, y, z[joint.z + 2]


@inner
def place_linkage(t, state, work, index, x, y, head):
    """Links and cylinder of joint B `index` (row of all joint tables), whose pivot is (x, y) on a head turned by `head`."""
    joint, linkage, z = t.joints[index], t.linkages[index], state.z
    theta = z[joint.z]
    for k in range(joint.first_link, joint.first_link + joint.links):
        link = t.links[k]
        bx, by, alpha = link_frame(link.side, joint, linkage, z, head, theta)
        work.position[link.history] = x + bx + link.middle * math.cos(alpha)
        work.position[link.history + 1] = y + by + link.middle * math.sin(alpha)
        work.position[link.history + 2] = alpha
    bx, by, alpha = link_frame(linkage.mount, joint, linkage, z, head, theta)
    wx, wy = turned_by(alpha, linkage.along, linkage.left)
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
            end = beam_shape(beam, t.psi[row], t.weights[row], z, rho, work.drho[row], work.turn[row])
            place_beam(beam, t.psi[row], rho, z, x, y, theta, c, s, position)
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
            place_linkage(t, state, work, row, x, y, theta)
            theta = z[t.joints[row].z]
            c, s = math.cos(theta), math.sin(theta)
        elif kind == JOINT_A:
            x, y, theta = t.joints[row].x, t.joints[row].y, z[t.joints[row].z]
            c, s = math.cos(theta), math.sin(theta)
    last = t.operations.shape[0]
    frames[last, 0], frames[last, 1], frames[last, 2], frames[last, 3], frames[last, 4] = x, y, theta, c, s
    position[t.tip], position[t.tip + 1], position[t.tip + 2] = x, y, theta
