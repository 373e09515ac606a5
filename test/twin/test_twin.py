"""The twin on samples that are late, doubled, incomplete, out of order, or from another time."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture
from drive_twin import drive_twin

from boom_twin import Sample, Settings, Stream, Twin, load_scene, statics
from boom_twin.types import StrokeReading

MS = 1_000_000
START = 1_700_000_000_000_000_000


@pytest.fixture(scope="module")
def scene():
    return load_scene()


@pytest.fixture(params=[Twin, drive_twin], ids=["lengths", "drives"])
def new(request):
    return request.param


@pytest.fixture
def twin(scene, new):
    return new(scene)


@pytest.fixture(scope="module")
def still(scene):
    return strokes_of_posture(scene, "arch")


def strokes(stamp_ms, values):
    return Sample(Stream.STROKES, START + int(stamp_ms * MS), np.array(values))


def angles(stamp_ms, values):
    return Sample(Stream.ANGLES, START + int(stamp_ms * MS), np.array(values))


def moved(still, t):
    """A smooth move of cylinders 1 and 3 within 0.4 s from 0.1 s on."""
    x = min(max((t - 0.1) / 0.4, 0.0), 1.0)
    return still + np.array([0.01, 0.0, -0.005, 0.0]) * (10 * x**3 - 15 * x**4 + 6 * x**5)


def follow(twin, still, stop, step=5, first=0):
    return [twin.update(strokes(ms, moved(still, ms * 1e-3))) for ms in range(first, stop, step)]


def equal(one, other):
    """Whether two predictions are the same to the bit."""
    fields = ("tip_position", "tip_displacement", "tip_acceleration", "joints", "strokes", "cylinder_forces")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in fields)


def is_at_rest(prediction):
    return np.abs(prediction.tip_acceleration).max() < 1e-12 and np.abs(prediction.tip_velocity).max() < 1e-12


def test_starts_in_static_equilibrium(scene, twin, still):
    named = "lengths" if twin.reads is StrokeReading.LENGTH else "strokes"
    report, rest = twin.update(strokes(0, still)), statics(scene, modes=0, **{named: still})
    assert report.accepted and report.status == "ok"
    assert report.prediction.tip_position == pytest.approx(rest.tip, abs=1e-8)
    assert report.prediction.joints == pytest.approx(rest.joints, abs=1e-9)
    assert report.prediction.cylinder_forces == pytest.approx(rest.cylinder_forces, rel=1e-6)
    assert report.prediction.tip_displacement == pytest.approx(rest.tip - rest.tip_rigid, abs=1e-8)
    assert is_at_rest(report.prediction)


def test_late_and_double_samples_are_left_out_and_counted(scene, new, still):
    clean, disturbed = new(scene), new(scene)
    expected = follow(clean, still, 300)
    got = []
    for ms in range(0, 300, 5):
        got.append(disturbed.update(strokes(ms, moved(still, ms * 1e-3))))
        assert disturbed.update(strokes(ms, moved(still, ms * 1e-3))).events == ("duplicate",)
        if ms:
            assert disturbed.update(strokes(ms - 2, moved(still, (ms - 2) * 1e-3))).events == ("late",)
    assert all(equal(a.prediction, b.prediction) for a, b in zip(expected, got, strict=True))
    assert disturbed.counts == {"duplicate": 60, "late": 59}


def test_partial_strokes_use_what_is_there(scene, still):
    whole, partial = drive_twin(scene), drive_twin(scene)
    for ms in range(0, 400, 5):
        values = moved(still, ms * 1e-3)
        a = whole.update(strokes(ms, values)).prediction
        if 200 <= ms < 220:
            values = values.copy()
            values[1] = np.nan  # cylinder 2 stands still anyway
        report = partial.update(strokes(ms, values))
        assert report.events == (("partial",) if 200 <= ms < 220 else ())
    assert report.prediction.tip_position == pytest.approx(a.tip_position, abs=1e-4)
    assert partial.counts["partial"] == 4


def test_waits_for_all_strokes(twin, still):
    lacking = still.copy()
    lacking[3] = np.nan
    report = twin.update(strokes(0, lacking))
    assert not report.accepted and "waiting" in report.events and report.prediction is None
    assert twin.update(strokes(5, np.full(4, np.nan))).events == ("empty",)
    assert twin.update(strokes(10, still)).accepted


def test_time_set_back_starts_everything_again(scene, new, still):
    fresh, looped = new(scene), new(scene)
    follow(looped, still, 2000)
    looped.update(angles(5000, np.zeros(4)))  # would wait for a stroke that never comes
    again, expected = follow(looped, still, 300), follow(fresh, still, 300)
    assert all(report.events == ("leap",) and report.prediction is None for report in again[:20])
    again = again[20:]
    assert again[0].events == ("jump back",) and again[0].change.from_rest
    assert is_at_rest(again[0].prediction)
    assert again[0].prediction.tip_position == pytest.approx(expected[20].prediction.tip_position, abs=1e-9)
    assert {each.stream for report in again for each in report.residuals} == {Stream.STROKES}


def test_a_failed_step_is_a_status_and_the_twin_starts_again(twin, still):
    """Wild strokes are followed once they have gone on for a second."""
    follow(twin, still, 300)
    wild = [twin.update(strokes(300 + 5 * k, still + 1e5)) for k in range(220)]
    assert any(not report.accepted and report.status != "ok" for report in wild)
    recovered = [twin.update(strokes(450 + 5 * k, still)) for k in range(200)][-1]
    assert recovered.accepted and np.isfinite(recovered.prediction.tip_position).all()


@pytest.mark.parametrize("cylinder, size", [(3, -0.18), (0, 0.02), (1, 0.2)])
def test_a_stroke_that_is_lost_for_half_a_second_does_not_move_the_tip(scene, still, cylinder, size):
    """It is held, with its cylinder at rest; what the strokes of the others do is followed."""
    twin, right = drive_twin(scene), []
    follow(twin, still, 1000)
    other = drive_twin(scene)
    follow(other, still, 1000)
    for k in range(200):
        ms = 1000 + 5 * k
        end = moved(still, 1.0)
        lost = end.copy()
        lost[cylinder] += size if k < 100 else 0.0
        right.append((twin.update(strokes(ms, lost)), other.update(strokes(ms, end))))
    off = [found.prediction.tip_position - wanted.prediction.tip_position for found, wanted in right]
    assert np.abs(off).max() < 1e-3 and twin.counts["implausible"] == 100 and "stroke elsewhere" not in twin.counts
    shaken = [found.prediction.tip_acceleration - wanted.prediction.tip_acceleration for found, wanted in right]
    assert np.abs(shaken).max() < 0.1


def test_a_stroke_that_stays_elsewhere_for_a_second_starts_the_model_from_rest_there(twin, still):
    follow(twin, still, 2500)
    elsewhere = moved(still, 1.0) + np.array([0.0, 0.02, 0.0, 0.0])
    reports = [twin.update(strokes(2500 + 5 * k, elsewhere)) for k in range(300)]
    (again,) = [report for report in reports if "stroke elsewhere" in report.events]
    assert again.change.from_rest and again.stamp == START + 3500 * MS
    assert is_at_rest(again.prediction) and "implausible" not in reports[-1].events
    assert reports[-1].prediction.strokes == pytest.approx(elsewhere, abs=1e-6)


@pytest.mark.parametrize("order", ["before", "after", "shuffled"])
def test_residuals_do_not_depend_on_the_order_of_arrival(scene, new, still, order):
    rng = np.random.default_rng(3)
    first = [strokes(ms, moved(still, ms * 1e-3)) for ms in range(0, 400, 5)]
    second = [angles(ms + 1.7, rng.normal(0.0, 1.0, 4)) for ms in range(0, 390, 5)]

    def residuals(samples):
        twin = new(scene)
        return {(r.stream, r.stamp): r.values for sample in samples for r in twin.update(sample).residuals}

    expected = residuals(sorted(first + second, key=lambda s: s.stamp))
    arrival = {
        "before": sorted(second + first, key=lambda s: s.stamp - (30 * MS if s.stream is Stream.ANGLES else 0)),
        "after": sorted(first + second, key=lambda s: s.stamp + (30 * MS if s.stream is Stream.ANGLES else 0)),
        "shuffled": sorted(first + second, key=lambda s: s.stamp // (20 * MS) * 2 + (s.stream is Stream.STROKES)),
    }[order]
    got = residuals(arrival)
    assert len(expected) == len(first) - 1 + len(second)
    assert got.keys() == expected.keys() and all(np.array_equal(got[k], expected[k]) for k in expected)


def test_a_residual_is_measured_minus_predicted_at_its_stamp(twin, still):
    reports = {r.stamp: r.prediction for r in follow(twin, still, 300)}
    at, after = START + 200 * MS, START + 205 * MS
    same = twin.update(angles(200, reports[at].joints + 0.01)).residuals[0]
    assert same.values == pytest.approx(np.full(4, 0.01), abs=1e-15)
    between = twin.update(angles(202, 0.6 * reports[at].joints + 0.4 * reports[after].joints)).residuals[0]
    assert between.values == pytest.approx(np.zeros(4), abs=1e-12)


def test_measured_samples_without_a_prediction_are_counted(twin, still):
    twin.update(strokes(1000, still))
    assert twin.update(angles(500, np.zeros(4))).events == ("unmatched",)
    partial = twin.update(angles(1000, np.array([0.0, np.nan, 0.0, 0.0])))
    assert partial.events == ("partial",) and np.isnan(partial.residuals[0].values[1])


@pytest.mark.parametrize("absurd", [np.inf, -np.inf, 1e300, -1e8])
def test_what_no_sensor_reads_is_taken_for_missing(scene, new, twin, still, absurd):
    clean = new(scene)
    follow(clean, still, 100), follow(twin, still, 100)
    values = moved(still, 0.1)
    values[2] = absurd
    expected, report = clean.update(strokes(100, np.where(values == absurd, np.nan, values))), twin.update(strokes(100, values))
    assert report.events == ("partial",) and equal(report.prediction, expected.prediction)
    report = twin.update(angles(100, np.array([0.0, absurd, 0.0, 0.0])))
    assert report.events == ("partial",) and np.isnan(report.residuals[0].values[1])
    assert twin.update(angles(101, np.full(4, absurd))).events == ("empty",)


def test_a_stroke_that_falls_silent_is_told_after_a_tenth_of_a_second(twin, still):
    follow(twin, still, 300)
    silent = moved(still, 0.3) * [1.0, np.nan, 1.0, 1.0]
    events = [twin.update(strokes(300 + 5 * k, silent)).events for k in range(40)]
    assert events == [("partial",)] * 20 + [("partial", "held")] * 20


def test_a_cylinder_that_starts_at_once_at_its_highest_speed_is_followed(twin, still):
    """Some readings are farther than the estimate allows; after a few of them in a row the next is believed."""
    follow(twin, still, 100)
    ways = 0.9 * Settings().stroke_rate * 0.005 * np.arange(60)
    reports = [twin.update(strokes(100 + 5 * k, still - np.array([way, 0.0, 0.0, 0.0]))) for k, way in enumerate(ways)]
    assert "stroke elsewhere" not in twin.counts
    assert reports[-1].prediction.strokes[0] == pytest.approx(still[0] - ways[-1], abs=0.01)
