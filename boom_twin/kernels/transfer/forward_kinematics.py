"""Positions from coordinates, base to tip: exact kinematics, so that the tree is closed at every iterate."""

from __future__ import annotations

import math

from ..elements.beam import BeamPart, Sizes, place_beam
from ..elements.cylinder import END_C, END_R, near, place_cylinder
from ..elements.linkage import LINK_L
from ..elements.pin_contact import BARREL_END_PIN, LINK_L_PIN, LINK_R_PIN, PIVOT, Q_PIN, ROD_END_PIN
from ..integrators import X
from ..jit import inner, kernel
from ..plane_algebra import COS, SIN, cosine_and_sine, rotated
from ..tables import (
    BEAM,
    BODY,
    FRAME_ANGLE,
    FRAME_COS,
    FRAME_SIN,
    FRAME_X,
    FRAME_Y,
    HEAD_TURN,
    JOINT_A,
    JOINT_B,
    LINK_L_TURN,
    LINK_R_TURN,
    OFFSET,
    ROD_PIN,
    SECTION_TURN,
    STATION,
    Z_LINK_L,
    Z_LINK_R,
    Z_SECTION,
)
from .clearance_pins import offset_of, set_turn


@inner
def link_frame(side, linkage, turns):
    """Pin on the body (from the pivot), and cosine and sine, of link L (pin D on the head) or R (pin E on the section)."""
    if side == LINK_L:
        x, y = rotated(turns[HEAD_TURN], turns[HEAD_TURN + 1], linkage.dx, linkage.dy)
        return x, y, turns[LINK_L_TURN], turns[LINK_L_TURN + 1]
    x, y = rotated(turns[SECTION_TURN], turns[SECTION_TURN + 1], linkage.ex, linkage.ey)
    return x, y, turns[LINK_R_TURN], turns[LINK_R_TURN + 1]


@inner
def origin_of(t, z, joint, side, x, y):
    """Return where the pin of link L or R would be if its body's vector to it were zero; (x, y): pivot of the head."""
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
    section, left, right = z[joint.z + Z_SECTION], z[joint.z + Z_LINK_L], z[joint.z + Z_LINK_R]
    turns[HEAD_TURN], turns[HEAD_TURN + 1] = c, s
    turns[SECTION_TURN], turns[SECTION_TURN + 1] = cosine_and_sine(section)
    turns[LINK_L_TURN], turns[LINK_L_TURN + 1] = cosine_and_sine(left)
    turns[LINK_R_TURN], turns[LINK_R_TURN + 1] = cosine_and_sine(right)
    for k in range(joint.first_link, joint.first_link + joint.links):
        link = t.links[k]
        bx, by, cl, sl = link_frame(link.side, linkage, turns)
        ox, oy = origin_of(t, z, joint, link.side, x, y)
        work.position[link.history] = ox + bx + link.middle * cl
        work.position[link.history + 1] = oy + by + link.middle * sl
        work.position[link.history + 2] = left if link.side == LINK_L else right
    bx, by, cl, sl = link_frame(linkage.mount, linkage, turns)
    wx, wy = rotated(cl, sl, linkage.along, linkage.left)
    ox, oy = origin_of(t, z, joint, linkage.mount, x, y)
    place_rod(t, state, work, index, ox + bx + wx, oy + by + wy, left if linkage.mount == LINK_L else right)
    set_turn(t, work, joint, PIVOT, section - theta)
    set_turn(t, work, joint, LINK_L_PIN, left - theta)
    set_turn(t, work, joint, LINK_R_PIN, right - section)
    set_turn(t, work, joint, Q_PIN, right - left)


@inner
def place_barrel(t, state, work, index, x, y, theta):
    """End C of cylinder `index`, whose pin is (x, y) on a body turned by theta."""
    cylinder, pins = t.cylinders[index], state.pins[index]
    dx, dy = offset_of(t, state.z, cylinder, BARREL_END_PIN)
    pins[END_C], pins[END_C + 1] = x + dx, y + dy
    set_turn(t, work, cylinder, BARREL_END_PIN, -theta)


@inner
def place_rod(t, state, work, index, x, y, theta):
    """End R of cylinder `index`, whose pin is (x, y) on a body turned by theta, and with it the whole cylinder."""
    cylinder, pins = t.cylinders[index], state.pins[index]
    dx, dy = offset_of(t, state.z, cylinder, ROD_END_PIN)
    pins[END_R], pins[END_R + 1] = x + dx, y + dy
    place_cylinder(
        cylinder, t.parts, pins[END_C], pins[END_C + 1], pins[END_R], pins[END_R + 1], state.history[X], work.position
    )
    for k in range(cylinder.first_clearance, cylinder.first_clearance + cylinder.clearances):
        row = t.clearances[k]
        if row.friction > 0.0:
            bush = theta if row.place == ROD_END_PIN else -work.position[row.turn]
            angle = math.atan2(pins[END_R + 1] - pins[END_C + 1], pins[END_R] - pins[END_C])
            work.position[row.turn] = near(angle - bush, state.history[X, row.turn])


@inner
def beam_part(t, work, row):
    """Tables and shape of the beam part `row`."""
    return BeamPart(
        psi=t.psi[row], weights=t.weights[row], stiffness=t.stiffness[row], mass=t.point_mass[row],
        rotary=t.point_rotary[row], rho=work.rho[row], drho=work.drho[row], turn=work.turn[row],
    )  # fmt: skip


@inner
def put_frame(frame, x, y, theta, c, s):
    """Write a row of `State.frames`."""
    frame[FRAME_X], frame[FRAME_Y], frame[FRAME_ANGLE], frame[FRAME_COS], frame[FRAME_SIN] = x, y, theta, c, s


@kernel
def place(t, state, work):
    """Frames, pins and all positions from the unknowns `state.z`."""
    z, frames, position = state.z, state.frames, work.position
    for i in range(z.shape[0]):
        position[i] = z[i]
    x, y, theta, c, s = 0.0, 0.0, 0.0, 1.0, 0.0
    if t.hinges.shape[0] > 0:
        theta = z[t.hinges[0].z]
        c, s = cosine_and_sine(theta)
    for k in range(t.operations.shape[0]):
        kind, row = t.operations[k].kind, t.operations[k].row
        put_frame(frames[k], x, y, theta, c, s)
        if kind == BEAM:
            beam, part = t.beams[row], beam_part(t, work, row)
            sizes = Sizes(beam.bending, beam.axial, beam.points)
            end = place_beam(beam, part, sizes, z, x, y, theta, c, s, position)
            bx, by = part.rho[beam.points, 0], part.rho[beam.points, 1]
            x, y, theta = x + c * bx - s * by, y + s * bx + c * by, theta + end
            c, s = rotated(c, s, part.turn[COS, beam.points], part.turn[SIN, beam.points])
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
            x, y, theta = x + dx, y + dy, z[t.joints[row].z + Z_SECTION]
            c, s = state.turns[row, SECTION_TURN], state.turns[row, SECTION_TURN + 1]
        elif kind == JOINT_A:
            joint = t.joints[row]
            bx, by = rotated(c, s, t.linkages[row].cx, t.linkages[row].cy)
            place_barrel(t, state, work, row, joint.x + bx, joint.y + by, theta)
            set_turn(t, work, joint, PIVOT, z[joint.z + Z_SECTION] - theta)
            state.turns[row, HEAD_TURN], state.turns[row, HEAD_TURN + 1] = c, s
            dx, dy = offset_of(t, z, joint, PIVOT)
            x, y, theta = joint.x + dx, joint.y + dy, z[joint.z + Z_SECTION]
            c, s = cosine_and_sine(theta)
    last = t.operations.shape[0]
    put_frame(frames[last], x, y, theta, c, s)
    position[t.tip], position[t.tip + 1], position[t.tip + 2] = x, y, theta
