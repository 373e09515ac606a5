"""Positions from coordinates, base to tip: exact kinematics, so that the tree is closed at every iterate."""

from __future__ import annotations

import math

from ..elements.beam import USUAL, Sizes, beam_shape, is_usual, place_beam
from ..elements.cylinder import near, place_cylinder
from ..elements.linkage import LINK_L
from ..elements.pin_contact import BARREL, LINK_L_PIN, LINK_R_PIN, PIVOT, Q_PIN, ROD
from ..integrators import X
from ..jit import inner, kernel
from ..plane_algebra import rotated
from ..tables import BEAM, BODY, JOINT_A, JOINT_B, OFFSET, ROD_PIN, STATION
from .clearance_pins import offset_of, set_turn


@inner
def link_frame(side, linkage, turns):
    """Pin on the body (from the pivot), and cosine and sine, of link L (pin D on the head) or R (pin E on the section)."""
    if side == LINK_L:
        x, y = rotated(turns[0], turns[1], linkage.dx, linkage.dy)
        return x, y, turns[4], turns[5]
    x, y = rotated(turns[2], turns[3], linkage.ex, linkage.ey)
    return x, y, turns[6], turns[7]


@inner
def origin_of(t, z, joint, side, x, y):
    """Where the pin of link L or R would be if its body's vector to it were zero, the pivot of the head being (x, y)."""
    if side == LINK_L:
        dx, dy = offset_of(t, z, joint, LINK_L_PIN)
        return x + dx, y + dy
    px, py = offset_of(t, z, joint, PIVOT)
    dx, dy = offset_of(t, z, joint, LINK_R_PIN)
    return x + px + dx, y + py + dy


@inner
def place_linkage(t, state, work, index, x, y, theta, c, s):
    """Links and cylinder of joint B `index` (row of all joint tables); its pivot on the head is (x, y), turned by theta."""
    joint, linkage, z, turns = t.joints[index], t.linkages[index], state.z, state.turns[index]
    turns[0], turns[1] = c, s
    for k in range(3):
        turns[2 + 2 * k], turns[3 + 2 * k] = math.cos(z[joint.z + k]), math.sin(z[joint.z + k])
    for k in range(joint.first_link, joint.first_link + joint.links):
        link = t.links[k]
        bx, by, cl, sl = link_frame(link.side, linkage, turns)
        ox, oy = origin_of(t, z, joint, link.side, x, y)
        work.position[link.history] = ox + bx + link.middle * cl
        work.position[link.history + 1] = oy + by + link.middle * sl
        work.position[link.history + 2] = z[joint.z + 1 + (link.side != LINK_L)]
    bx, by, cl, sl = link_frame(linkage.mount, linkage, turns)
    wx, wy = rotated(cl, sl, linkage.along, linkage.left)
    ox, oy = origin_of(t, z, joint, linkage.mount, x, y)
    place_rod(t, state, work, index, ox + bx + wx, oy + by + wy, z[joint.z + 1 + (linkage.mount != LINK_L)])
    set_turn(t, work, joint, PIVOT, z[joint.z] - theta)
    set_turn(t, work, joint, LINK_L_PIN, z[joint.z + 1] - theta)
    set_turn(t, work, joint, LINK_R_PIN, z[joint.z + 2] - z[joint.z])
    set_turn(t, work, joint, Q_PIN, z[joint.z + 2] - z[joint.z + 1])


@inner
def place_barrel(t, state, work, index, x, y, theta):
    """End C of cylinder `index`, whose pin is (x, y) on a body turned by theta."""
    cylinder, pins = t.cylinders[index], state.pins[index]
    dx, dy = offset_of(t, state.z, cylinder, BARREL)
    pins[0], pins[1] = x + dx, y + dy
    set_turn(t, work, cylinder, BARREL, -theta)


@inner
def place_rod(t, state, work, index, x, y, theta):
    """End R of cylinder `index`, whose pin is (x, y) on a body turned by theta, and with it the whole cylinder."""
    cylinder, pins = t.cylinders[index], state.pins[index]
    dx, dy = offset_of(t, state.z, cylinder, ROD)
    pins[2], pins[3] = x + dx, y + dy
    place_cylinder(cylinder, t.parts, pins[0], pins[1], pins[2], pins[3], work.position)
    for k in range(cylinder.first_clearance, cylinder.first_clearance + cylinder.clearances):
        row = t.clearances[k]
        if row.friction > 0.0:
            bush = theta if row.place == ROD else -work.position[row.turn]
            angle = math.atan2(pins[3] - pins[1], pins[2] - pins[0])
            work.position[row.turn] = near(angle - bush, state.history[X, row.turn])


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
            bx, by = rotated(c, s, outlet.x, outlet.y)
            place_barrel(t, state, work, outlet.cylinder, x + bx, y + by, theta)
        elif kind == ROD_PIN:
            outlet = t.outlets[row]
            bx, by = rotated(c, s, outlet.x, outlet.y)
            place_rod(t, state, work, 0, x + bx, y + by, theta)
        elif kind == JOINT_B:
            place_linkage(t, state, work, row, x, y, theta, c, s)
            dx, dy = offset_of(t, z, t.joints[row], PIVOT)
            x, y, theta, c, s = x + dx, y + dy, z[t.joints[row].z], state.turns[row, 2], state.turns[row, 3]
        elif kind == JOINT_A:
            joint = t.joints[row]
            dx, dy = offset_of(t, z, joint, PIVOT)
            x, y, theta = joint.x + dx, joint.y + dy, z[joint.z]
            c, s = math.cos(theta), math.sin(theta)
            set_turn(t, work, joint, PIVOT, theta)
            place_barrel(t, state, work, row, joint.x + t.linkages[row].cx, joint.y + t.linkages[row].cy, 0.0)
    last = t.operations.shape[0]
    frames[last, 0], frames[last, 1], frames[last, 2], frames[last, 3], frames[last, 4] = x, y, theta, c, s
    position[t.tip], position[t.tip + 1], position[t.tip + 2] = x, y, theta
