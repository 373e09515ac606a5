"""Steps of the twin follow their error: against the same move in steps ten times finer; shorter where a bound asks for it."""

from __future__ import annotations

import numpy as np
import pytest
from drive_twin import drive_twin
from oracle import booms

from boom_twin.analysis.methods import integrate_with
from boom_twin.compiler.compile import compile_scene
from boom_twin.config.settings import Settings
from boom_twin.estimation.step_choice import RISE, SHARE, choose_steps
from boom_twin.scene import load_scene
from boom_twin.scene.kinematics import stroke_curve

SCENE = load_scene()


def chosen(scene=SCENE, **settings):
    return choose_steps(scene, compile_scene(scene), Settings(**settings))


def true_errors(scene, step):
    """Tip (m) and acceleration (m/s^2), rms over the test move in steps of `step`, against ten times finer ones."""
    middle = np.radians([sum(joint.range_deg) / 2 for joint in scene.joints])
    first = np.array([stroke_curve(scene, i, middle[i : i + 1])[0] for i in range(len(middle))])
    way = SHARE * np.array([joint.cylinder.max_stroke for joint in scene.joints])

    def drive(times):
        x = np.clip(times / RISE, 0.0, 1.0)
        speed = 30 * x**2 * (1 - x) ** 2 / RISE
        return first + np.outer(10 * x**3 - 15 * x**4 + 6 * x**5, way), np.outer(speed, way)

    coarse, fine = (integrate_with(scene, drive, RISE, step / n, every=n, angles=middle) for n in (1, 10))
    tips = (coarse.tip - fine.tip)[1:], (coarse.tip_acceleration - fine.tip_acceleration)[1:]
    return [float(np.sqrt((off**2).sum(axis=1).mean())) for off in tips]


@pytest.mark.parametrize("seed", [None, 4])
def test_the_stated_error_is_the_real_one(seed):
    """Of the remembered boom; a look ahead that is exact leaves nothing beside it."""
    scene = SCENE if seed is None else booms.random_boom(seed)
    found = chosen(scene, look_step=5e-4, step_acceleration_error=10.0)
    tip, acceleration = true_errors(scene, found.step)
    assert found.tip_error == pytest.approx(tip, rel=0.3)
    assert found.acceleration_error == pytest.approx(acceleration, rel=0.4)


def test_the_default_scene_takes_its_longest_steps_and_says_how_good_they_are():
    found = chosen()
    assert (found.step, found.look_step) == (0.005, 0.026)
    assert 0.0 < found.tip_error < 2e-4 and 0.0 < found.acceleration_error < 0.15
    assert chosen() == found, "the same for every twin of the scene"


def test_a_tighter_bound_gives_shorter_steps():
    found = chosen(step_tip_error=1e-5)
    assert found.step == 0.00125 and found.look_step < 0.0065
    assert found.tip_error <= 1e-5
    by_acceleration = chosen(step_acceleration_error=0.01)
    assert by_acceleration.step == 0.0025 and by_acceleration.look_step <= 0.0065


def test_longer_steps_are_taken_where_their_error_allows_it():
    assert chosen(step=0.01, step_tip_error=1e-3).step == 0.01
    assert chosen(step=0.04, step_tip_error=1e-3, step_acceleration_error=0.1).step == 0.01


def test_a_scene_without_the_test_move_takes_the_longest_steps():
    """Equilibrium in the middle of the ranges is no condition for a scene: oil like rubber has none."""
    soft = [joint.cylinder.model_copy(update={"k": 100.0, "d": None}) for joint in SCENE.joints]
    joints = tuple(joint.model_copy(update={"cylinder": own}) for joint, own in zip(SCENE.joints, soft, strict=True))
    found = chosen(SCENE.model_copy(update={"joints": joints}))
    assert (found.step, found.look_step) == (0.005, 0.026) and np.isnan(found.tip_error)


def test_the_twin_steps_by_it():
    twin = drive_twin(SCENE, Settings(step_tip_error=1e-5))
    tuning = twin._compiled.limits.tuning
    assert (tuning.step, tuning.look_step) == twin.steps[:2] == chosen(step_tip_error=1e-5)[:2]
