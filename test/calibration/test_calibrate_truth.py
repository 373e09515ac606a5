"""Calibration finds what the virtual rig, an independent model, was made with."""

from __future__ import annotations

import numpy as np
import pytest
from calibration.sessions import ENCODERS, made, off
from default_boom import anew, parameter
from oracle import booms
from oracle.booms import short_boom

from boom_twin import load_scene
from boom_twin.calibration import Choice, calibrate
from boom_twin.calibration.output import write_scene
from boom_twin.scene.schema import Oil


def expected(name, truth, zeros):
    if not name.endswith(".zero"):
        return parameter(truth, name)
    kind, number = name.removesuffix(".zero").rsplit("_", 1)
    return zeros[int(number) - 1] if kind == "joint" else 0.0


def share_covered(found, truth, zeros, width=1.0):
    """Of the estimates, those whose interval (widened by `width`) holds the truth."""
    inside = []
    for estimate in found.estimates:
        middle, half = estimate.value, width * 0.5 * (estimate.high - estimate.low)
        inside.append(abs(expected(estimate.unknown.name, truth, zeros) - middle) <= half)
    return np.mean(inside)


def errors(found, truth, zeros):
    return {e.unknown.name: e.value - expected(e.unknown.name, truth, zeros) for e in found.estimates}


def judge(found, joints):
    """The twin with the result predicts what was held out as well as the sensors measure."""
    assert np.all(found.after.spread[:joints] < 1.2) and np.all(found.after.spread[:joints] > 0.8)
    assert 0.9 < found.misfit < 1.15


@pytest.mark.slow
def test_everything_at_once_keeps_to_its_intervals(wrong_boom, tmp_path):
    bags = [wrong_boom.write(tmp_path / f"s{seed}", seed, ENCODERS) for seed in (5, 6)]
    found = calibrate(bags, load_scene(), Choice(load="payload"))
    wrong = errors(found, wrong_boom.truth, ENCODERS)
    for i, bound in enumerate((0.03, 0.02, 0.03, 0.08), start=1):
        assert abs(wrong[f"cylinder_{i}.k"]) < bound * parameter(wrong_boom.truth, f"cylinder_{i}.k")
    assert abs(wrong["tip.payload"]) < 3.0
    assert share_covered(found, wrong_boom.truth, ENCODERS) >= 0.8
    judge(found, 4)


@pytest.mark.slow
def test_under_a_pump_and_wind_that_nobody_told(tmp_path):
    scene = load_scene()
    truth = off(scene, 1.06, 0.92, 1.08, 0.9, **{"tip.payload": 12.0})
    bag = made(truth, "arch", 60.0, 9, ("pump:0.43:130", "wind:15")).write(tmp_path / "bag", 3, ENCODERS)
    found = calibrate([bag], scene, Choice(load="payload", zeros="angles"))
    wrong = errors(found, truth, ENCODERS)
    for i, bound in enumerate((0.02, 0.02, 0.02, 0.05), start=1):
        assert abs(wrong[f"cylinder_{i}.k"]) < bound * parameter(truth, f"cylinder_{i}.k")
        assert abs(wrong[f"joint_{i}.zero"]) < np.radians(0.01)
    assert abs(wrong["tip.payload"]) < 3.0
    assert share_covered(found, truth, ENCODERS) >= 0.8
    assert 0.9 < found.misfit < 1.15


@pytest.mark.slow
def test_a_right_model_stays_where_it_is(tmp_path):
    scene = load_scene()
    bag = made(scene, "arch", 60.0, 3).write(tmp_path / "bag", 7)
    found = calibrate([bag], scene)
    assert share_covered(found, scene, np.zeros(4), 2.0) == 1.0
    judge(found, 4)
    np.testing.assert_allclose(found.after.spread, found.before.spread, rtol=0.2)  # zeros of strokes and angles trade off


@pytest.mark.slow
def test_three_sections_with_another_bending_stiffness(tmp_path):
    scene = short_boom(3)
    truth = off(scene, 1.05, 1.0, 0.95, **{"section_2.EI": 1.1 * parameter(scene, "section_2.EI")})
    bag = made(truth, "arch", 45.0, 8).write(tmp_path / "bag", 8)
    found = calibrate([bag], scene, Choice(stiffness=True, zeros="none"))
    assert share_covered(found, truth, np.zeros(3), 2.0) == 1.0


def test_two_sections_without_an_imu(two_sections, tmp_path):
    truth = off(two_sections, 0.92, 1.1)
    bag = made(truth, "arch", 40.0, 4, ("pump:0.5:150",)).write(tmp_path / "bag", 1, imu=False)
    found = calibrate([bag], two_sections, Choice(zeros="angles"))
    wrong = errors(found, truth, np.zeros(2))
    for i in (1, 2):
        assert abs(wrong[f"cylinder_{i}.k"]) < 0.04 * parameter(truth, f"cylinder_{i}.k")
        assert abs(wrong[f"joint_{i}.zero"]) < np.radians(0.01)
    judge(found, 2)


def test_an_elastic_base_is_found_by_encoders_and_imu(two_sections, tmp_path):
    """The tilt of the tip IMU against the encoders goes with the moment of the boom, from posture to posture."""
    truth, scene = (booms.on_elastic_base(two_sections, stiffness) for stiffness in (5.0e6, 8.0e6))
    bag = made(truth, "arch", 30.0, 4, ("pump:0.5:150",)).write(tmp_path / "bag", 1)
    found = calibrate([bag], scene, Choice(names=("base.stiffness",)))
    assert share_covered(found, truth, np.zeros(2)) == 1.0
    assert found.estimates[0].value == pytest.approx(5.0e6, rel=0.05)
    write_scene(found, scene, anew(scene), tmp_path / "new.yaml", "by a test")
    assert load_scene(tmp_path / "new.yaml").base.stiffness == pytest.approx(found.estimates[0].value, rel=1e-5)


def test_oil_gets_another_bulk_modulus(two_sections, tmp_path):
    """Cylinder 1 has oil: the factor on its stiffness is found, and written where the scene has it."""
    oil = Oil(bore=0.105, rod=0.07, bulk_modulus=1.5e9, cap_line=1e-3, rod_line=1e-3)
    first, *rest = two_sections.joints
    cylinder = first.cylinder.model_copy(update={"k": None, "oil": oil})
    scene = two_sections.model_copy(update={"joints": (first.model_copy(update={"cylinder": cylinder}), *rest)})
    truth = off(scene, 0.9, 1.1)
    bag = made(truth, "arch", 40.0, 4, ("pump:0.5:150",)).write(tmp_path / "bag", 1)
    found = calibrate([bag], scene, Choice(zeros="angles"))
    write_scene(found, scene, anew(scene), tmp_path / "new.yaml", "by a test")
    now = load_scene(tmp_path / "new.yaml").joints[0].cylinder
    assert now.k is None and now.oil.bulk_modulus == pytest.approx(0.9 * 1.5e9, rel=0.03)
    assert now.oil.model_copy(update={"bulk_modulus": 1.5e9}) == oil
