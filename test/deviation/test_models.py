"""Filters on lengths against textbook algebra: transition by a matrix exponential, readings and mixtures by their formulas."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest
from default_boom import EXACT, strokes_of_posture
from scipy.linalg import expm

from boom_twin import Sample, Scene, Settings, Stream, Twin, load_scene, statics
from boom_twin.deviation.kalman import DRIVE_TIME, FAST, SLOW, correct, make_transition, transit
from boom_twin.deviation.learning import learnt
from boom_twin.deviation.mixture import CLOSES, COMES, OPENS, STAYS, first_model, interact, mix
from boom_twin.deviation.posture import Posture
from boom_twin.deviation.predictor import BoomPredictor
from boom_twin.deviation.rows import length_row
from boom_twin.deviation.states import ALL_VALVES, ESTIMATE, LOADS, PREDICTION, Filters, all_states, zero_place
from boom_twin.types import Array

SCENE = load_scene()
DRIVES = strokes_of_posture(SCENE, "arch")
REST = statics(SCENE, DRIVES)
N, STEP = len(DRIVES), 5_000_000
Z_FOLD = files("boom_twin") / "examples" / "five_section_z_fold.yaml"


@pytest.fixture(scope="module")
def boom() -> BoomPredictor:
    """At rest in posture arch."""
    found = BoomPredictor(SCENE, Settings())
    found.start(REST.lengths)
    return found


def test_transition_is_that_of_the_continuous_system_with_inputs_held(boom: BoomPredictor) -> None:
    p, f, m, h = boom.posture, boom.filters, int(boom.posture.modes[0]), 0.005
    size = 2 * m + LOADS + 3 * N
    load, drive = 2 * m, 2 * m + LOADS
    a = np.zeros((size, size))
    for j in range(m):
        a[j, m + j], a[m + j, j], a[m + j, m + j] = 1.0, -(p.omega[j] ** 2), -p.decay[j]
        a[m + j, load : load + 2] = a[m + j, load + 2 : load + 4] = p.readings[2 + N + j, N : N + 2]
        a[m + j, drive + 2 * N :] = -p.forces[2 + N + j] / p.omega[j] ** 2
    for i in range(N):
        a[drive + i, drive + N + i] = a[drive + N + i, drive + 2 * N + i] = 1.0
    expected = expm(a * h)
    smooth = expm(h * np.array([[0.0, 1.0], [-1.0 / FAST**2, -2.0 / FAST]]))  # critically damped
    for k in (load, load + 1):
        expected[: 2 * m, k + 4] = 0.5 * h * expected[: 2 * m, k]  # the mean of a load with this rate over the step
        expected[np.ix_([k, k + 4], [k, k + 4])] = smooth
        expected[k + 2, k + 2] = np.exp(-h / SLOW)
    for i in range(N):
        expected[drive + 2 * N + i, drive + 2 * N + i] = np.exp(-h / DRIVE_TIME)
    make_transition.py_func(p, f, h)
    assert transition_of(p, f, size) == pytest.approx(expected, rel=1e-9, abs=1e-12)


def transition_of(p: Posture, f: Filters, size: int) -> Array:
    """The first `size` rows and columns of the transition matrix as a full one; sensors' errors and copies stay."""
    found, own = np.eye(size), zero_place.py_func(p)
    found[:own, :own] = f.transition[:own, :own].T
    return found


def test_covariance_is_propagated_by_the_full_transition_matrix_and_lags_drift() -> None:
    """Every state has a random covariance with every other."""
    boom, h, rng = BoomPredictor(SCENE, Settings(), lagging=[Stream.ANGLES]), 0.005, np.random.default_rng(7)
    boom.start(REST.lengths)
    p, f = boom.posture, boom.filters
    p.behind[0] += len(p.errors)  # the last are the lag and its drift; a first reading admits them
    size = all_states.py_func(p)
    make_transition.py_func(p, f, h)
    transition = transition_of(p, f, size)
    transition[size - 2, size - 1] = h
    f.p[ALL_VALVES] = 0.0
    transit.py_func(p, f, ALL_VALVES, size, h, f.load2[0], 0.0)
    noise, root, x = f.p[ALL_VALVES, :size, :size].copy(), rng.normal(size=(size, size)), rng.normal(size=size)
    f.x[ALL_VALVES, :size], f.p[ALL_VALVES, :size, :size] = x, root @ root.T
    transit.py_func(p, f, ALL_VALVES, size, h, f.load2[0], 0.0)
    assert f.x[ALL_VALVES, :size] == pytest.approx(transition @ x, rel=1e-9, abs=1e-9)
    expected = transition @ root @ root.T @ transition.T + noise
    assert f.p[ALL_VALVES, :size, :size] == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_reading_is_taken_as_the_textbook_has_it() -> None:
    rng = np.random.default_rng(1)
    root, row, x = rng.normal(size=(8, 8)), rng.normal(size=8), rng.normal(size=8)
    covariance, variance, innovation = root @ root.T, 0.3, 0.7
    s = row @ covariance @ row + variance
    gain = covariance @ row / s
    left = np.eye(8) - np.outer(gain, row)
    joseph = left @ covariance @ left.T + variance * np.outer(gain, gain)
    state, found = x.copy(), covariance.copy()
    assert correct.py_func(state, found, row, np.zeros((4, 8)), innovation, variance, 8) == pytest.approx(s)
    assert state == pytest.approx(x + gain * innovation)
    assert found == pytest.approx(joseph)


def test_mixture_has_mean_and_covariance_of_its_models(boom: BoomPredictor) -> None:
    f, size, rng = boom.filters, 7, np.random.default_rng(2)
    x, chances = rng.normal(size=(3, size)), np.array([0.5, 0.2, 0.3])
    f.x[:3, :size], f.chances[:3] = x, chances
    for k in range(3):
        root = rng.normal(size=(size, size))
        f.p[k, :size, :size] = root @ root.T
    mix.py_func(f, PREDICTION, size)
    mean = chances @ x
    apart = x - mean
    spread = np.einsum("k,kij->ij", chances, f.p[:3, :size, :size]) + np.einsum("k,ki,kj->ij", chances, apart, apart)
    assert f.mean[PREDICTION, :size] == pytest.approx(mean)
    assert f.spread[PREDICTION, :size, :size] == pytest.approx(spread)
    boom.start(REST.lengths)


@pytest.mark.parametrize("mixture", [PREDICTION, ESTIMATE])
def test_probabilities_of_models_are_those_of_a_markov_chain(mixture: int, boom: BoomPredictor) -> None:
    """Valves as believed open (OPENS) or a load comes (COMES), and ends (CLOSES, STAYS); valves open under a new load, too."""
    f, h = boom.filters, 0.002
    first = first_model.py_func(mixture)
    rates = np.array([[-OPENS - COMES, OPENS, COMES], [CLOSES, -CLOSES, 0.0], [STAYS, OPENS, -STAYS - OPENS]])
    before = np.array([0.5, 0.3, 0.2])
    f.chances[first : first + 3], f.is_open[:] = before, 0
    interact.py_func(f, mixture, 7, h, 0.5)
    assert f.chances[first : first + 3] == pytest.approx(before @ expm(h * rates), abs=2e-6)
    assert f.chances[first : first + 3].sum() == pytest.approx(1.0)
    boom.start(REST.lengths)


def test_a_usual_load_is_learnt_up_to_one_that_has_just_come(boom: BoomPredictor) -> None:
    f, most = boom.filters, boom.filters.noise.burst_load**2
    assert 0.5 * most < learnt.py_func(f, 0.5 * most, 4.0 * most, 0.1) < most
    assert learnt.py_func(f, most, 4.0 * most, 0.1) == most


@pytest.mark.parametrize("scene", [SCENE, load_scene(Z_FOLD)], ids=["k", "oil"])
def test_length_row_is_the_compression_of_the_oil(scene: Scene) -> None:
    """length = drive + c F: the length that statics has at another drive; c of a column of oil follows the drive."""
    found, step = BoomPredictor(scene, Settings()), 1e-5
    found.start(statics(scene, "arch").lengths)
    p, n, drives = found.posture, len(scene.joints), statics(scene, "arch").strokes
    drive = 2 * int(p.modes[0]) + LOADS
    for i in range(n):
        row = np.zeros(found.filters.x.shape[1])
        length_row.py_func(p, i, row)
        for k in range(n):
            change = step * np.eye(n)[k]
            lengths = statics(scene, drives + change).lengths - statics(scene, drives - change).lengths
            assert row[drive + k] == pytest.approx(lengths[i] / (2.0 * step), rel=1e-5, abs=1e-6)


def test_a_boom_at_rest_is_predicted_where_statics_has_it_however_soft_the_oil_is() -> None:
    """Of a cylinder 30 % softer than the scene the lengths tell all the same where the tip is."""
    joints = [joint.model_copy(update={"cylinder": joint.cylinder.model_copy(update={"k": 0.7 * (joint.cylinder.k or 0.0)})})
              for joint in SCENE.joints]  # fmt: skip
    softer = statics(SCENE.model_copy(update={"joints": tuple(joints)}), DRIVES)
    twin, rng = Twin(SCENE, EXACT), np.random.default_rng(3)
    for k in range(400):
        values = softer.lengths + rng.normal(0.0, 2e-5, N)
        report = twin.update(Sample(Stream.STROKES, 10**18 + k * STEP, values))
    assert report.prediction is not None and report.estimate is not None
    assert np.hypot(*(report.prediction.tip_position - softer.tip)) < 1e-3  # taken for drives it is off by 0.3 m
    assert report.estimate.tip == pytest.approx([*report.prediction.tip_position, report.prediction.tip_angle])
    assert (np.sqrt(report.estimate.tip_covariance[[0, 3]]) < 1e-3).all()


def test_a_mode_that_swings_is_told_with_the_tips_velocity_and_lengths_have_innovations(boom: BoomPredictor) -> None:
    """From lengths with noise, of free vibration in the lowest mode after a blow; at the end transducer 2 jumps by 1 mm."""
    p, m, twin, rng = boom.posture, int(boom.posture.modes[0]), Twin(SCENE), np.random.default_rng(4)
    row, omega, half = np.zeros(boom.filters.x.shape[1]), p.omega[0], 0.5 * p.decay[0]
    shown = np.zeros((N, 2))  # of coordinate and rate
    for i in range(N):
        length_row.py_func(p, i, row)
        shown[i] = row[0], row[m]
    motion = p.readings[2 + N, N : N + 3]
    assert motion[1] > 0.0, "a positive coordinate lifts the tip"
    ratios, modes, velocities, sigmas = [], [], [], []
    for k in range(1000):
        size, phase = 0.3 * np.exp(-half * k * 0.005) * (k > 100), omega * (k - 100) * 0.005
        mode = size * np.sin(phase), size * (omega * np.cos(phase) - half * np.sin(phase))
        jump = 1e-3 * np.eye(N)[1] if k == 999 else 0.0
        values = REST.lengths + shown @ mode + rng.normal(0.0, 2e-5, N) + jump
        report = twin.update(Sample(Stream.STROKES, 10**18 + k * STEP, values))
        assert [each.stream for each in report.residuals] == [Stream.STROKES] * (k > 0)
        ratios += [each.normalised for each in report.residuals]
        if 700 <= k < 999:
            modes.append([report.estimate.modes[0], mode[0], report.estimate.mode_rates[0], mode[1]])
            velocities.append([report.estimate.velocity, motion * mode[1]])
            sigmas.append(np.sqrt(report.estimate.velocity_covariance[[0, 3, 5]]))
    for found, true in np.array(modes).T.reshape(2, 2, -1):
        assert np.sqrt(np.mean((found - true) ** 2)) < 0.15 * np.abs(true).max()
    assert np.isnan([*report.estimate.modes[m:], *report.estimate.mode_rates[m:]]).all()
    found, true = np.moveaxis(velocities, 1, 0)
    assert (np.sqrt(np.mean((found - true) ** 2, axis=0)) < 0.15 * np.abs(true).max(axis=0)).all()
    assert 0.3 < np.sqrt(np.mean(((found - true) / sigmas) ** 2)) < 1.5
    assert np.sqrt(np.mean(np.square(ratios[-300:-1]), axis=0)) == pytest.approx(np.ones(N), abs=0.25)
    assert report.residuals[0].names[1] == "cylinder_2" and report.residuals[0].values[1] == pytest.approx(1e-3, abs=1e-4)
    assert abs(ratios[-1][1]) > 20.0 and np.abs(ratios[-1][[0, 2, 3]]).max() < 5.0


def test_a_zero_is_known_beside_the_mount_and_as_well_as_the_scene() -> None:
    """At rest a zero and the mount read alike; mount and scale do not change. Forces are 2 % uncertain."""
    boom = BoomPredictor(SCENE, Settings())
    boom.start(REST.lengths)
    covariance, first = boom.filters.spread[ESTIMATE], zero_place(boom.posture)
    covariance[first : first + 4, first : first + 4] = [
        [0.3, 0.0, 0.2, 0.0],
        [0.0, 0.5, 0.0, 0.1],
        [0.2, 0.0, 0.4, 0.0],
        [0.0, 0.1, 0.0, 0.2],
    ]
    covariance[first + 5 + N, first + 5 + N] = 1e6  # of the second force, behind as many angles
    boom.filters.pulls[1] = 1e5
    _, variances, errors = boom.sensors.zeros(["tip_imu_x", "tip_imu_z", "cylinder_force_2"])
    assert variances == pytest.approx([0.3 - 0.2**2 / 0.4, 0.5 - 0.1**2 / 0.2, 1e6])
    assert errors == pytest.approx([0.0, 0.0, 2e3])
