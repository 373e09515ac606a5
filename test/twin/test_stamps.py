"""Stamps that step: stray ones, pauses, clocks that are set, second sources; and samples that a program made wrongly."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from default_boom import strokes_of_posture
from drive_twin import drive_twin

from boom_twin import Sample, Stream, Twin, UsageError, load_scene
from boom_twin.validation.rig.motion import Move, Programme

MS = 1_000_000
START = 1_700_000_000_000_000_000
STEP, COUNT = 5 * MS, 1600
AFTER = 400  # samples, 2 s
SEED = 3


def session(seed: int) -> list[Sample]:
    """8 s of an own drive, with the noise of the sensors."""
    rng, scene = np.random.default_rng(seed), load_scene()
    start = strokes_of_posture(scene, "arch")
    moves = []
    for i in rng.choice(4, 2, replace=False):
        way, time = rng.uniform(-0.04, 0.04), rng.uniform(0.2, 3.0)
        moves.append(Move(int(i), time, rng.uniform(1.5, 4.0), float(start[i] + way)))
    times = np.arange(COUNT) * STEP * 1e-9
    true = Programme(tuple(start.tolist()), tuple(moves))(times)[0]
    noisy = np.round((true + rng.normal(0.0, 2e-5, true.shape)) / 5e-6) * 5e-6
    stamps = START + np.arange(COUNT) * STEP + rng.integers(-200_000, 200_000, COUNT)
    return [Sample(Stream.STROKES, stamp, row) for stamp, row in zip(stamps.tolist(), noisy, strict=True)]


ROWS = np.array([sample.values for sample in session(SEED)])
AT = 250 + int(np.argmax(np.abs(ROWS[250:1000] - ROWS[230:980]).max(axis=1)))


@pytest.fixture(scope="module")
def samples():
    return session(SEED)


@pytest.fixture(scope="module")
def scene():
    return load_scene()


@pytest.fixture(scope="module")
def clean(scene, samples):
    """Predictions of an undisturbed twin, and twins as they are before some samples, in motion and at rest."""
    twin, predictions, before = Twin(scene), [], {}
    for k, sample in enumerate(samples):
        if k in (AT, 700, 1000):
            before[k] = copy.deepcopy(twin)
        predictions.append(twin.update(sample).prediction)
    return predictions, before


def tips(twin, samples):
    """Predicted tips by stamp."""
    every = [twin.update(sample).prediction for sample in samples]
    return {p.stamp: p.tip_position for p in every if p is not None}


def misses(clean, found, first, last):
    """Distance (m) of tips from the clean ones, by number of the sample."""
    return [float(np.hypot(*(found[p.stamp] - p.tip_position))) for p in clean[0][first:last] if p.stamp in found]


@pytest.mark.parametrize("at", [AT, 700, 1000])
@pytest.mark.parametrize("shift", [1, 3, 7, 40, 90, 200, 500, 900, 3000, 10**9, -1, -40, -500, -900, -5000, -(10**9)])
def test_one_stray_stamp_moves_nothing(samples, clean, at, shift):
    twin, stray = copy.deepcopy(clean[1][at]), samples[at]
    stray = Sample(stray.stream, stray.stamp + shift * MS, stray.values)
    found = tips(twin, [stray, *samples[at + 1 : at + AFTER]])
    away = misses(clean, found, at + 1, at + AFTER)
    assert len(away) > AFTER - 25 and max(away) < 0.005


@pytest.mark.parametrize(("shift", "event"), [(-5_000_000, "jump back"), (-900, "jump back"), (5_000_000, "restart")])
def test_a_clock_set_in_motion_starts_the_model_again_and_is_told(samples, clean, shift, event):
    at = max(clean[1], key=lambda k: _speed(clean, k))
    twin = copy.deepcopy(clean[1][at])
    reports = [twin.update(Sample(s.stream, s.stamp + shift * MS, s.values)) for s in samples[at : at + AFTER]]
    (again,) = [report for report in reports if event in report.events]
    assert again.change.from_rest and again.stamp - reports[0].stamp < 150 * MS
    last, clear = reports[-1].prediction, clean[0][at + AFTER - 1]
    assert np.hypot(*(last.tip_position - clear.tip_position)) < 0.02


def _speed(clean, k):
    return float(np.abs(clean[0][k].strokes - clean[0][k - 20].strokes).max())


@pytest.mark.parametrize("at", [AT, 700, 1000])
@pytest.mark.parametrize("pause", [30, 100, 180])
def test_a_pause_is_caught_up(samples, clean, at, pause):
    twin = copy.deepcopy(clean[1][at])
    found = tips(twin, samples[at + pause : at + pause + AFTER + 1])
    away = misses(clean, found, at + pause, at + pause + AFTER + 1)
    assert len(away) == len(samples[at + pause + 1 : at + pause + AFTER + 1]) and away[-1] < 0.010
    assert twin.counts == {"leap": 1, "gap": 1}


@pytest.mark.parametrize("shift", [7200_000, -7200_000, 2500, -2500])
def test_a_second_source_is_refused_and_told(samples, clean, shift):
    """It begins at once, beside the first, with the same stamps but hours or seconds apart, and strokes of its own."""
    twin, mixed = copy.deepcopy(clean[1][700]), []
    for s in samples[700:1100]:
        mixed += [s, Sample(s.stream, s.stamp + shift * MS, s.values + 0.05)]
    reports = [twin.update(sample) for sample in mixed]
    assert all(report.change is None for report in reports)
    assert twin.counts["second source"] > 390 and twin.counts["leap"] <= 3
    got = [report.prediction.tip_position for report in reports if report.prediction is not None]
    expected = [prediction.tip_position for prediction in clean[0][700:1100]]
    assert all(np.array_equal(a, b) for a, b in zip(got, expected, strict=True))


def test_a_caller_may_use_its_array_again(samples, scene):
    one, other, values, residuals = Twin(scene), Twin(scene), np.empty(4), []
    for s in samples[:20]:
        for twin, given in ((one, s.values.copy()), (other, values)):
            given[:] = 0.5
            pending = twin.update(Sample(Stream.ANGLES, s.stamp, given))
            given[:] = s.values
            report = twin.update(Sample(s.stream, s.stamp, given))
            assert not pending.residuals
            residuals.append(report.residuals[0].values)
    assert all(np.array_equal(a, b) for a, b in zip(residuals[::2], residuals[1::2], strict=True))


def test_equal_stamps_with_other_values_are_a_second_source(samples, clean):
    twin = copy.deepcopy(clean[1][700])
    for s in samples[700:720]:
        assert twin.update(s).accepted
        assert twin.update(s).events == ("duplicate",)
        assert twin.update(Sample(s.stream, s.stamp, s.values + 0.05)).events == ("second source",)


def test_the_stated_deviation_of_a_start_from_rest_is_true(samples, clean, scene):
    """The boom moves, time is set back, strokes go on elsewhere: what the angles are off by is stated, and decays."""
    at = max(clean[1], key=lambda k: _speed(clean, k))
    for jump in (0, -200):
        twin, found = copy.deepcopy(clean[1][at]), []
        shift = -7200_000 * MS
        for k in range(at + 60 + jump, len(samples)):
            s, true = samples[k], clean[0][k].joints
            twin.update(Sample(s.stream, s.stamp + shift, s.values))
            for residuals in twin.update(Sample(Stream.ANGLES, s.stamp + shift, true)).residuals:
                found.append((k, residuals.normalised, residuals.sigmas))
        assert twin.counts["jump back"] == 1
        normalised = np.array([row for k, row, _ in found if k > found[0][0] + 100])
        assert np.abs(normalised).max() < 4.0
        assert np.all(found[-1][2] < found[0][2])


@pytest.mark.parametrize(
    ("sample", "words"),
    [
        (("cylinder_strokes", 1, np.zeros(4)), "Stream.STROKES"),
        (("tip_imu", 1, np.zeros(2)), "Stream.IMU"),
        ((Stream.STROKES, 1.7e9, np.zeros(4)), r"round\(seconds \* 1e9\)"),
        ((Stream.STROKES, True, np.zeros(4)), "nanoseconds"),
        ((Stream.STROKES, 2**64, np.zeros(4)), "64 bits"),
        ((Stream.STROKES, 1, np.zeros(3)), r"array\(.*4 numbers, cylinder_1..cylinder_4"),
        ((Stream.IMU, 1, [0.0]), "2 numbers"),
        ((Stream.ANGLES, 1, ["a", "b", "c", "d"]), "joint_1..joint_4"),
        ((Stream.ANGLES, 1, None), "joint_1..joint_4"),
        ((Stream.STROKES, 1, np.zeros(4) + 1j), "Give 4 numbers"),
        ((Stream.STROKES, 1, ["0.1", "0.2", "0.3", "0.4"]), "Give 4 numbers"),
        ((Stream.STROKES, 1, [True, False, True, False]), "Give 4 numbers"),
    ],
)
def test_samples_made_wrongly_are_refused_with_the_remedy(scene, sample, words):
    with pytest.raises(UsageError, match=words):
        Twin(scene).update(Sample(*sample))


@pytest.mark.parametrize("unit", [1, 10**3, 10**6], ids=["s", "ms", "us"])
def test_stamps_in_another_unit_are_refused(scene, samples, unit):
    twin = Twin(scene)
    with pytest.raises(UsageError, match=r"round\(seconds \* 1e9\)"):
        for k, s in enumerate(samples[:400]):
            twin.update(Sample(s.stream, int(k * 0.005 * unit), s.values))


@pytest.mark.parametrize(("late", "refused"), [(2, 2), (4, 3)])
def test_a_row_sent_late_with_the_time_of_sending_is_refused_and_counted(scene, late, refused):
    """A source that was kept waiting, and stamps what was due with the time of sending, 6 us apart: 20 us on, one is taken."""
    rest, start, step = ROWS[0], 10**18, 1_000_000
    stamps = [start + k * step for k in range(400)]
    stamps[300 : 301 + late] = [stamps[300 + late] + 30_000 + 6_000 * k for k in range(late + 1)]
    twin = Twin(scene)
    found = tips(twin, [Sample(Stream.STROKES, stamp, rest) for stamp in stamps])
    missing = [stamp for stamp in stamps if stamp not in found]
    assert missing == stamps[301 : 301 + refused]
    assert twin.counts == {"duplicate": refused}


@pytest.mark.parametrize("set_by", [900, 3000])
def test_a_clock_set_while_the_boom_swings_at_rest_is_covered_by_the_deviation(samples, clean, scene, set_by):
    """It looks like a pause at rest: the vibration goes on in another phase, by up to what is stated."""
    kicked, twin = [], drive_twin(scene)
    still = samples[0].values
    for k in range(900):
        drive = 0.01 * np.clip((k - 100) / 60, 0.0, 1.0)  # a stop that leaves the first mode swinging
        kicked.append(Sample(Stream.STROKES, samples[0].stamp + k * 5 * MS, still + np.array([drive, 0.0, 0.0, 0.0])))
    truth = [twin.update(s).prediction.tip_position for s in kicked]
    twin, off = drive_twin(scene), []
    for k, s in enumerate(kicked):
        shift = set_by * MS if k >= 300 else 0
        each = twin.update(Sample(s.stream, s.stamp + shift, s.values))
        if k > 301 and each.prediction is not None:
            off.append((each.prediction.tip_position - truth[k], np.sqrt(each.estimate.tip_covariance[[0, 3]])))
    error, stated = (np.hypot(*np.array(column).T) for column in zip(*off, strict=True))
    assert twin.counts == {"leap": 1, "gap": 1}
    assert error[:200].max() > 0.005, "both readings of the stamps fit, and one is wrong"
    assert np.sqrt(np.mean(error**2)) < 1.3 * np.sqrt(np.mean(stated**2)) and np.all(error < 3.0 * stated)
    assert stated[-1] < stated[0]


@pytest.mark.parametrize("at", [AT, 700, 1000])
@pytest.mark.parametrize("pause", [60, 180])
def test_what_a_pause_hides_is_in_the_stated_deviation(samples, clean, at, pause):
    twin, off = copy.deepcopy(clean[1][at]), []
    for k in range(at + pause, at + pause + AFTER):
        report = twin.update(samples[k])
        if report.prediction is not None and k > at + pause + 40:
            stated = np.sqrt(report.estimate.tip_covariance[[0, 3]])
            off.append((report.prediction.tip_position - clean[0][k].tip_position, stated))
    error, stated = (np.hypot(*np.array(column).T) for column in zip(*off, strict=True))
    assert np.all(error < 3.0 * stated + 0.001)
