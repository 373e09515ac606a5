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
from published import motion, spin

STEP, END, ROWS = 1e-2, 18.0, 1800  # rows every 10 ms
LAG, LAG_TIME = -0.574, 6.76  # m, s
MOMENTS = {2.5: -0.1512, 5.0: -0.4685, 10.0: -0.3628}  # s: m
EXTENSION = spin.MASS * spin.SPEED**2 * spin.LENGTH**3 / (3.0 * spin.AXIAL)


@pytest.fixture(scope="module")
def frames():
    """Extension and deflection at all rows, for steps of 10, 5 and 2.5 ms; shape (3, rows + 1, 2)."""
    start = motion.released(spin.scene(), np.zeros(spin.PIVOTS))
    found = motion.halved(start, STEP, END, ROWS, spin.drive, halvings=2)
    return spin.in_the_turning_frame(found[:, :, 0, :2], np.linspace(0.0, END, ROWS + 1))


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
    start = [motion.released(spin.scene(modes), np.zeros(spin.PIVOTS)) for modes in (3, 6)]
    coarse, fine = (motion.stepped(one, STEP, 1000, 250, spin.drive)[:, 0, :2] for one in start)
    assert coarse == pytest.approx(fine, abs=1e-6)
