"""A beam that is turned from rest to 6 rad/s within 15 s.

J. C. Simo, L. Vu-Quoc: On the dynamics of flexible beams under large overall motions, the plane case, part II. J. Applied
Mechanics 53, 1986. L. Vu-Quoc, J. C. Simo: The role of non-linear theories in transient dynamic analysis of flexible
structures, J. Sound and Vibration 119, 1987. The tip lags by 0.574 m at most, and in the end stands out by 5.14e-4 m, which is
rho_A omega^2 L^3/(3 EA). Single moments, to 1e-4 m: 16 cable elements of Exudyn 1.13, steps of 2.5 ms. Shear, which they have
(GA = 1e7 N) and the boom has not, makes 2e-5 m.

A linkage of the boom turns by less than a half turn, the manoeuvre by ten turns: so the beam stands on 26 of them in a row, all
in one place, without masses.
"""

from __future__ import annotations

import numpy as np
import pytest
from published import motion, scenes

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


STEP, END, ROWS = 1e-2, 18.0, 1800  # rows every 10 ms
LAG, LAG_TIME = -0.574, 6.76  # m, s
MOMENTS = {2.5: -0.1512, 5.0: -0.4685, 10.0: -0.3628}  # s: m
EXTENSION = MASS * SPEED**2 * LENGTH**3 / (3.0 * AXIAL)


@pytest.fixture(scope="module")
def frames():
    """Extension and deflection at all rows, for steps of 10, 5 and 2.5 ms; shape (3, rows + 1, 2)."""
    start = motion.released(scene(), np.zeros(PIVOTS))
    found = motion.halved(start, STEP, END, ROWS, drive, halvings=2)
    return in_the_turning_frame(found[:, :, 0, :2], np.linspace(0.0, END, ROWS + 1))


def lowest(deflection):
    """Time (s) and size (m) of the largest lag, by a parabola through three rows."""
    k = int(np.argmin(deflection))
    before, at, after = deflection[k - 1 : k + 2]
    shift = 0.5 * (before - after) / (before - 2.0 * at + after)
    return (k + shift) * END / ROWS, at - 0.25 * (before - after) * shift


def test_largest_lag(frames):
    time, lag = motion.extrapolated(np.array([lowest(deflection) for deflection in frames[:, :, 1]]))
    assert lag == pytest.approx(LAG, abs=5e-4) and time == pytest.approx(LAG_TIME, abs=5e-3)


def test_single_moments(frames):
    """To a digit of the reference; the steps leave 6e-5 m at 2.5 ms, and their square is extrapolated away."""
    limit = motion.extrapolated(frames[:, :, 1])
    for time, deflection in MOMENTS.items():
        assert limit[round(time * ROWS / END)] == pytest.approx(deflection, abs=1e-4), time


def test_second_order(frames):
    """Of the whole ramp at once, extension and deflection each."""
    changes = np.linalg.norm(np.diff(frames[:, :1500], axis=0), axis=1)
    assert motion.orders(changes) == pytest.approx(2.0, abs=0.02)


def test_steady_extension(frames):
    """Mean over the whole swings of the tip that fit into what follows the ramp."""
    extension, deflection = frames[-1, 1500:].T
    up = np.flatnonzero((deflection[:-1] < 0.0) & (deflection[1:] >= 0.0))
    assert len(up) >= 2
    assert extension[up[0] : up[-1]].mean() == pytest.approx(EXTENSION, rel=2e-3)
    assert abs(EXTENSION - 5.14e-4) < 5e-7
    assert np.abs(deflection).max() < 0.01


def test_more_shapes_change_little():
    start = [motion.released(scene(modes), np.zeros(PIVOTS)) for modes in (3, 6)]
    coarse, fine = (motion.stepped(one, STEP, 1000, 250, drive)[:, 0, :2] for one in start)
    assert coarse == pytest.approx(fine, abs=1e-6)
