"""Linearisation at a posture against statics at neighbouring drives, natural modes found anew, and the response at 0 Hz."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import joint_angles_of_strokes, strokes_of_posture

from boom_twin import Settings, frequency_response, load_scene, statics
from boom_twin.analysis.equilibrium import rest_at
from boom_twin.analysis.modal import natural_modes
from boom_twin.deviation.posture import linearise
from boom_twin.deviation.predictor import BoomPredictor

SCENE = load_scene()
DRIVES = strokes_of_posture(SCENE, "arch")
N = len(DRIVES)


@pytest.fixture(scope="module")
def boom() -> BoomPredictor:
    """Linearised in posture arch."""
    found = BoomPredictor(SCENE, Settings())
    found.start(statics(SCENE, DRIVES).lengths)
    return found


def test_lengths_at_rest_give_back_the_drives(boom: BoomPredictor) -> None:
    assert boom.posture.drives == pytest.approx(DRIVES, abs=1e-9)
    assert boom.posture.pulled == pytest.approx(statics(SCENE, DRIVES).cylinder_forces, rel=1e-9)


@pytest.mark.parametrize("i", range(N))
def test_columns_of_drives_are_those_of_statics(boom: BoomPredictor, i: int) -> None:
    step = 1e-5 * np.eye(N)[i]
    one, other = statics(SCENE, DRIVES + step), statics(SCENE, DRIVES - step)
    p, column = boom.posture, 2 + i
    assert p.forces[column] == pytest.approx((one.cylinder_forces - other.cylinder_forces) / 2e-5, rel=1e-5, abs=1.0)
    assert p.readings[column, :N] == pytest.approx((one.joints - other.joints) / 2e-5, rel=1e-5, abs=1e-5)
    assert p.readings[column, N : N + 2] == pytest.approx((one.tip - other.tip) / 2e-5, rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("a", (0, 1))
def test_column_of_force_and_modes_add_up_to_the_response_at_0_hz(boom: BoomPredictor, a: int) -> None:
    # the response has five shapes a part where the twin has three: 2e-4 of the flexibility
    found = frequency_response(SCENE, [1e-4], DRIVES, tip_force=np.eye(2)[a])
    p, m = boom.posture, int(boom.posture.modes[0])
    modal = p.readings[2 + N : 2 + N + m, N + a] / p.omega[:m] ** 2
    total = p.readings[a] + modal @ p.readings[2 + N : 2 + N + m]
    assert total[N : N + 2] == pytest.approx(found.tip[0].real, rel=1e-3, abs=1e-9)
    assert total[:N] == pytest.approx(found.joints[0].real, rel=1e-3, abs=1e-9)


def test_modes_followed_over_a_move_are_those_found_anew(boom: BoomPredictor) -> None:
    p, m = boom.posture, int(boom.posture.modes[0])
    end = DRIVES + np.array([0.02, -0.01, 0.015, 0.02])
    for share in np.linspace(0.125, 1.0, 8):  # steps of 0.01 rad at most, as a twin takes them
        assert linearise(*boom.held[:2], *boom.held[3:5], DRIVES + share * (end - DRIVES), True) == 0
    plan, state, work = rest_at(SCENE, end, joint_angles_of_strokes(SCENE, end))
    anew = natural_modes(plan, state, work, m, 1e-9)
    assert p.omega[:m] / (2.0 * np.pi) == pytest.approx([mode.frequency for mode in anew], rel=2e-5)
    forces = np.array([mode.increments[plan.tables.cylinders.z] for mode in anew])
    for j in range(m):
        sign = np.sign(forces[j] @ p.forces[2 + N + j])
        assert p.forces[2 + N + j] == pytest.approx(sign * forces[j], rel=2e-3, abs=2e-3 * np.abs(forces[j]).max())
    boom.start(statics(SCENE, DRIVES).lengths)
