"""Round-off: digits lost by the two ways of combining elements, and the error over ever smaller steps."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import posture_angles
from studies.roundoff.exact_step import digits, one_step
from studies.roundoff.report import TARGET, TURN_UP_STEPS, turn_up

from boom_twin import load_scene
from boom_twin.validation.study.long_booms import long_boom


def test_plain_product_loses_digits_with_the_length_and_riccati_does_not():
    steps = [one_step(boom, posture_angles(boom, "test"), 1e-3, 0.8) for boom in map(long_boom, (2, 3, 5, 20))]
    plain, riccati = ([digits(getattr(step, name)) for step in steps] for name in ("plain", "riccati"))
    assert np.all(np.diff(plain) > 0.5) and plain[-1] > 15.0
    assert max(riccati) < 2.5
    assert max(step.exact for step in steps) < 1e-15


def test_error_of_the_tip_falls_with_the_square_of_the_step():
    found = turn_up(load_scene(), tuple(step for step in TURN_UP_STEPS if step >= 1e-5))
    assert found.order == pytest.approx(2.0, abs=0.05)
    assert not found.turned_up_above_target
    assert found.floor[1] < 0.1 * TARGET
