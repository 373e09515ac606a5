"""Prediction from lengths alone: error of the tip's acceleration at rest and in haste."""

from __future__ import annotations

import numpy as np
import pytest
from analysis.reference_errors import rms
from deviation.motions import measured, true_motion

from boom_twin import Sample, Stream, Twin, load_scene
from boom_twin.offline.recording import Recording
from boom_twin.twin.blocks import SampleBlock
from boom_twin.types import SECOND


def followed(session, **options):
    """A twin that has followed the strokes of a session, and what it predicted."""
    twin, recording = Twin(load_scene(), **options), Recording(4)
    block = SampleBlock(np.zeros(len(session.stamps), np.int64), session.stamps, session.strokes)
    recording.add(twin.take(block), block)
    return twin, recording.whole.predictions


def error(name, rate=200.0):
    """Of the tip's acceleration, m/s^2 rms."""
    session = measured(name, rate)
    return rms(followed(session)[1].tip_acceleration - session.acceleration)


@pytest.mark.parametrize(("name", "bound"), [("rests", 0.23), ("sweep", 0.70), ("stops", 1.0)])
def test_quiet_at_rest_and_quick_in_haste(name, bound):
    assert error(name) < bound


@pytest.mark.parametrize("name", ["rests", "stops"])
def test_more_samples_a_second_are_better(name):
    errors = np.array([error(name, rate) for rate in (50.0, 100.0, 200.0, 1000.0)])
    assert (errors[1:] < 1.05 * errors[:-1]).all() and errors[-1] < 0.9 * errors[0]


def test_the_angle_sensor_of_the_joint_replaces_a_transducer_that_sticks():
    """Cylinder 4 sticks at rest, is found when it moves, and the tip is right again a second after that."""
    at, error, _ = error_of_a_stuck_cylinder(3, 1200, has_angles=True)
    assert np.abs(error[at > 7.5]).max() < 5e-3


@pytest.mark.parametrize(("cylinder", "first"), [(0, 700), (3, 1700)])
def test_a_transducer_that_sticks_in_a_move_and_that_nothing_replaces_leaves_the_tip_unknown(cylinder, first):
    at, error, sigmas = error_of_a_stuck_cylinder(cylinder, first, has_angles=False)
    late = at > first / 200.0 + 1.0
    assert np.abs(error[late]).max() > 0.2
    assert (np.abs(error[late]) < 3.0 * sigmas[late]).all()


def error_of_a_stuck_cylinder(cylinder, first, has_angles):
    """Times (s), errors (m) of the estimated tip and their stated deviations, where a transducer sticks from sample `first`."""
    session, twin, tips, sigmas = measured("rests"), Twin(load_scene(), health=True), {}, []
    times, boom = true_motion("rests")
    stuck = session.strokes.copy()
    stuck[first:, cylinder] = stuck[first, cylinder]
    for stamp, strokes, joints in zip(session.stamps.tolist(), stuck, session.joints, strict=True):
        report = twin.update(Sample(Stream.STROKES, stamp, strokes))
        if has_angles:
            twin.update(Sample(Stream.ANGLES, stamp, joints))
        assert report.prediction is not None and report.estimate is not None
        tips[stamp] = report.prediction.tip_position if has_angles else report.estimate.tip[:2]
        sigmas.append(np.sqrt(report.estimate.tip_covariance[[0, 3]]))
    at = np.array(list(tips)) / SECOND - 100.0
    error = np.array(list(tips.values())) - np.column_stack([np.interp(at, times, column) for column in boom.tip[:, :2].T])
    return at, error, np.array(sigmas)


@pytest.mark.parametrize(("name", "rate"), [("stops", 50.0), ("sweep", 50.0), ("12 Hz", 50.0)])
def test_no_sensor_is_accused_of_a_motion_in_haste(name, rate):
    """At 50 Hz a filter that lags has the readings of joints jump."""
    twin, session, alarms = Twin(load_scene(), health=True), measured(name, rate), set()
    for stamp, strokes, joints in zip(session.stamps.tolist(), session.strokes, session.joints, strict=True):
        for stream, values in ((Stream.STROKES, strokes), (Stream.ANGLES, joints)):
            if (health := twin.update(Sample(stream, stamp, values)).health) is not None:
                alarms |= {(alarm.channel, alarm.kind) for alarm in health.alarms}
    assert not alarms
