"""The spin-up manoeuvre in the boom's elements: many driven pivots in one place, each turning by less than a half turn."""

from __future__ import annotations

import numpy as np
from published import scenes

from boom_twin.kernels.elements.linkage import cylinder_length
from boom_twin.scene.kinematics import linkage

PIVOTS = 26
LENGTH, AXIAL, BENDING, MASS, ROTARY = 10.0, 2.8e7, 1.4e4, 1.2, 6e-4  # m, N, N m^2, kg/m, kg m
RAMP, SPEED = 15.0, 6.0  # s, rad/s
SHARE = 2.5  # rad, most that a pivot turns


def angle(time):
    """psi, rad, and its rate, rad/s, at times (m,)."""
    wave = 2.0 * np.pi / RAMP
    ramp = SPEED / RAMP * (time**2 / 2.0 + (np.cos(wave * time) - 1.0) / wave**2)
    rate = SPEED / RAMP * (time - np.sin(wave * time) / wave)
    turning = time > RAMP
    return np.where(turning, SPEED * (time - RAMP / 2.0), ramp), np.where(turning, SPEED, rate)


def scene(modes=3):
    """A beam on `PIVOTS` pivots in the origin, without weight.

    Every cylinder stands at a right angle to its lever when its pivot has turned by half of `SHARE`.
    """
    middle = SHARE / 2.0
    sections = [{"length": scenes.NOWHERE} for _ in range(PIVOTS - 1)]
    sections[0] |= {"rod_pin": tuple(scenes.turn(-middle))}
    d, e = np.array(scenes.LINKS["D"]), scenes.turn(middle)
    half = (e - d) / 2.0
    q = d + half + np.array([-half[1], half[0]]) * np.sqrt(1.0 / (half @ half) - 1.0)
    pin = 3.0 * scenes.turn(np.arctan2(q[1], q[0]) - np.pi / 2.0)
    joints = [scenes.crank(scenes.DRIVEN), *[scenes.six_bar(scenes.DRIVEN, pin)] * (PIVOTS - 1)]
    beam = scenes.beam(LENGTH, AXIAL, BENDING, MASS, ROTARY)
    return scenes.scene([*sections, beam], joints, gravity=(0.0, 0.0), modes=modes)


def drive(time):
    """Lengths (m) and rates (m/s) of all cylinders, each (m, `PIVOTS`), at times (m,)."""
    model = scene()
    psi, rate = angle(time)
    assert psi.max() < PIVOTS * SHARE
    rows = [linkage(model, 0), linkage(model, 1)]
    crank, six_bar = np.array([[cylinder_length(row, turned) for turned in psi / PIVOTS] for row in rows])
    lengths, slopes = np.stack([crank, *[six_bar] * (PIVOTS - 1)], axis=0).transpose(2, 1, 0)
    return lengths, slopes * rate[:, None] / PIVOTS


def in_the_turning_frame(tip, time):
    """Extension u and deflection v of the tip (m) against the rigid beam, shape (.., 2), at times (m,)."""
    psi, _ = angle(time)
    c, s = np.cos(psi), np.sin(psi)
    x, y = tip[..., 0], tip[..., 1]
    return np.stack([c * x + s * y - LENGTH, c * y - s * x], axis=-1)
