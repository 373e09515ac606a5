"""Linearisation at a posture against statics at neighbouring drives, natural modes found anew, and the response at 0 Hz."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import joint_angles_of_strokes, strokes_of_posture
from oracle import booms

from boom_twin import Scene, Settings, frequency_response, load_scene, statics
from boom_twin.analysis.equilibrium import Equilibrium, rest_at
from boom_twin.analysis.modal import natural_modes
from boom_twin.deviation.posture import linearise, settle_at
from boom_twin.deviation.predictor import BoomPredictor
from boom_twin.deviation.states import PREDICTION, drive_place
from boom_twin.deviation.step import write_ways
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.types import Mount

RIGID = load_scene()
DRIVES = strokes_of_posture(RIGID, "arch")
N = len(DRIVES)
MOUNTS: tuple[Mount | None, ...] = ("root", None, None, None)


@pytest.fixture(scope="module", params=[None, 5.0e6], ids=["rigid base", "elastic base"])
def scene(request: pytest.FixtureRequest) -> Scene:
    """The default scene, and on an elastic base."""
    return booms.on_elastic_base(RIGID, request.param, request.param and 5.0e4)


@pytest.fixture(scope="module")
def boom(scene: Scene) -> BoomPredictor:
    """Linearised in posture arch, with an inclinometer on section 1."""
    found = BoomPredictor(scene, Settings(), MOUNTS)
    found.start(statics(scene, DRIVES).lengths)
    return found


def angles(found: Equilibrium) -> np.ndarray:
    """What the angle sensors read of a boom at rest on a level base, rad."""
    return np.append(found.joints[0] + (found.base_turn or 0.0), found.joints[1:])


def test_lengths_at_rest_give_back_the_drives(boom: BoomPredictor, scene: Scene) -> None:
    assert boom.posture.drives == pytest.approx(DRIVES, abs=1e-9)
    assert boom.posture.pulled == pytest.approx(statics(scene, DRIVES).cylinder_forces, rel=1e-9)


@pytest.mark.parametrize("i", range(N))
def test_columns_of_drives_are_those_of_statics(boom: BoomPredictor, scene: Scene, i: int) -> None:
    step = 1e-5 * np.eye(N)[i]
    one, other = statics(scene, DRIVES + step), statics(scene, DRIVES - step)
    p, column = boom.posture, 2 + i
    assert p.forces[column] == pytest.approx((one.cylinder_forces - other.cylinder_forces) / 2e-5, rel=1e-5, abs=1.0)
    assert p.readings[column, :N] == pytest.approx((angles(one) - angles(other)) / 2e-5, rel=1e-5, abs=1e-5)
    assert p.readings[column, N : N + 2] == pytest.approx((one.tip - other.tip) / 2e-5, rel=1e-5, abs=1e-4)


@pytest.mark.parametrize("a", (0, 1))
def test_column_of_force_and_modes_add_up_to_the_response_at_0_hz(boom: BoomPredictor, scene: Scene, a: int) -> None:
    # the response has five shapes a part where the twin has three: 2e-4 of the flexibility
    found = frequency_response(scene, [1e-4], DRIVES, tip_force=np.eye(2)[a])
    p, m = boom.posture, int(boom.posture.modes[0])
    modal = p.readings[2 + N : 2 + N + m, N + a] / p.omega[:m] ** 2
    total = p.readings[a] + modal @ p.readings[2 + N : 2 + N + m]
    assert total[N : N + 2] == pytest.approx(found.tip[0].real, rel=1e-3, abs=1e-9)
    assert total[1:N] == pytest.approx(found.joints[0, 1:].real, rel=1e-3, abs=1e-9)


def test_decay_is_that_of_the_response_at_resonance(boom: BoomPredictor, scene: Scene) -> None:
    p, column = boom.posture, 2 + N
    found = frequency_response(scene, [p.omega[0] / (2.0 * np.pi)], DRIVES, tip_force=(0.0, 1.0))
    assert found.tip[0, 1].imag == pytest.approx(-(p.readings[column, N + 1] ** 2) / (p.decay[0] * p.omega[0]), rel=1e-2)


def test_modes_followed_over_a_move_are_those_found_anew(boom: BoomPredictor, scene: Scene) -> None:
    p, m = boom.posture, int(boom.posture.modes[0])
    end = DRIVES + np.array([0.02, -0.01, 0.015, 0.02])
    for share in np.linspace(0.125, 1.0, 8):  # steps of 0.01 rad at most, as a twin takes them
        assert linearise(*boom.compiled[:2], *boom.compiled[3:5], DRIVES + share * (end - DRIVES), True) == 0
    plan, state, work = rest_at(scene, end, joint_angles_of_strokes(scene, end))
    anew = natural_modes(plan, state, work, m, 1e-9)
    assert p.omega[:m] / (2.0 * np.pi) == pytest.approx([mode.frequency for mode in anew], rel=2e-5)
    forces = np.array([mode.increments[plan.tables.cylinders.z] for mode in anew])
    for j in range(m):
        sign = np.sign(forces[j] @ p.forces[2 + N + j])
        assert p.forces[2 + N + j] == pytest.approx(sign * forces[j], rel=2e-3, abs=2e-3 * np.abs(forces[j]).max())
    boom.start(statics(scene, DRIVES).lengths)


def test_modal_forces_of_curved_ways_are_those_of_the_masses_accelerations(scene: Scene) -> None:
    """Positions of all masses at rest along a straight way of the drives: their second differences are the accelerations."""
    found, v, h = BoomPredictor(scene, Settings()), np.array([0.03, -0.05, 0.04, 0.06]), 5e-3
    found.start(statics(scene, DRIVES).lengths)
    (tables, live, _, work, p, f, *_), places = found.compiled, list[np.ndarray]()
    for step in (h, -h, 0.0):
        assert settle_at(tables, live, work, p, DRIVES + step * v) == 0
        place(tables, live, work)
        places.append(work.position.copy())
    curved = (places[0] + places[1] - 2.0 * places[2]) / h**2
    f.mean[PREDICTION, drive_place(p) + N : drive_place(p) + 2 * N] = v
    write_ways.py_func(live, live, work, p, f)
    expected = -(p.motions * p.masses) @ curved
    m = int(p.modes[0])
    assert f.swing[:m] == pytest.approx(
        expected[:m], rel=0.06, abs=0.02 * np.abs(expected).max()
    )  # links and cylinders are approximate
    assert np.abs(expected).max() > 0.1
