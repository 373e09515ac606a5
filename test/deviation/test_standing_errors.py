"""Errors of strokes that last: zeros, and the rounding at rest. Witnesses: statics at rest, sampled rounding, a motion."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from analysis.reference_errors import rms
from default_boom import strokes_of_posture
from deviation.motions import measured, true_motion
from scipy.stats import norm

from boom_twin import Sample, Stream, Twin, load_scene, statics
from boom_twin.config.settings import Settings
from boom_twin.deviation.predictor import BoomPredictor
from boom_twin.types import SECOND, SENSORS, StrokeReading

SCENE, ZERO, STEP, DRAWS = load_scene(), 2e-4, 4e-4, 12
LENGTH, ANGLE = StrokeReading.LENGTH, StrokeReading.ANGLE


@pytest.mark.parametrize(
    ("reads", "mounts", "settings"),
    [
        (LENGTH, (), {"stroke_zero": ZERO}),
        (LENGTH, (), {"stroke_resolution": STEP}),
        (ANGLE, (), {"angle_resolution": 2e-3}),
        (ANGLE, ("root compensated",) * 4, {"angle_resolution": 2e-3}),
    ],
)
def test_the_stated_tip_moves_by_each_error_as_the_boom_at_rest_does(reads, mounts, settings):
    every = [Settings(scene_error=0.0, **each) for each in ({}, settings)]
    exact, boom = (BoomPredictor(SCENE, each, mounts, reads) for each in every)
    readings = boom.finder.readings_at(statics(SCENE, strokes_of_posture(SCENE, "arch")).lengths)
    for each in (exact, boom):
        each.start(readings)
    for each in (exact, boom):  # what a filter that is exactly at rest states
        each.filters.spread[:] = 0.0
    nudges = 1e-6 * np.eye(4)
    ways = np.array([(boom.finder.tip_at(readings + e) - boom.finder.tip_at(readings - e)) / 2e-6 for e in nudges])
    error2 = every[1].stroke_zero ** 2 + every[1].standing(SENSORS[reads.stream])
    assert boom.tip_sigmas**2 - exact.tip_sigmas**2 == pytest.approx(error2 * (ways[:, :2] ** 2).sum(axis=0), rel=0.05)


@pytest.mark.parametrize("dither", [0.0, 0.1, 0.25, 0.5])
def test_rounding_at_rest_lasts_as_far_as_noise_does_not_dither_it(dither):
    settings = Settings(stroke_resolution=STEP, stroke_sigma=dither * STEP)
    at, edges = np.linspace(-0.5, 0.5, 2001), np.arange(-5.5, 6.0)  # of steps
    means = norm.cdf((at[:, None] - edges) / max(dither, 1e-9)).sum(axis=1) - 6.0 - at
    assert settings.standing(SENSORS[Stream.STROKES]) == pytest.approx(STEP**2 * np.mean(means**2), rel=0.01)


def followed(session, settings, has_angles):
    """Errors (k, 2; m) of the estimated tip from 3 s on, the stated deviations, forces (k, 2; N), theirs, and alarms."""
    twin, found, alarms = Twin(SCENE, settings, health=True), [], set()
    for stamp, strokes, joints in zip(session.stamps.tolist(), session.strokes, session.joints, strict=True):
        reports = [twin.update(Sample(Stream.STROKES, stamp, strokes))]
        if has_angles:
            reports.append(twin.update(Sample(Stream.ANGLES, stamp, joints)))
        alarms |= {alarm.kind for each in reports if each.health for alarm in each.health.alarms}
        found.append(reports[0].estimate)
    at, (times, boom) = session.stamps / SECOND - 100.0, true_motion("rests")
    true = np.column_stack([np.interp(at, times, column) for column in boom.tip[:, :2].T])
    tips, tip2, loads, load2 = (
        np.array(each)[at > 3.0]
        for each in zip(*((e.tip[:2], e.tip_covariance[[0, 3]], e.load, e.load_variance) for e in found), strict=True)
    )
    return SimpleNamespace(tip=tips - true[at > 3.0], tip2=tip2, load=loads, load2=load2, alarms=alarms)


@pytest.mark.parametrize("has_angles", [False, True])
def test_zeros_of_strokes_are_stated_and_found_by_angles(has_angles):
    session, rng, over, errors = measured("rests"), np.random.default_rng(5), [], []
    for _ in range(DRAWS if not has_angles else DRAWS // 3):
        zeroed = session._replace(strokes=session.strokes + ZERO * rng.standard_normal(4))
        one = followed(zeroed, Settings(stroke_zero=ZERO, scene_error=0.0), has_angles)
        over.append(np.mean(one.tip**2 / one.tip2))
        errors.append(rms(one.tip))
        assert not one.alarms
    assert 0.2 < math.sqrt(np.mean(over)) < 1.5
    assert (max(errors) < 4e-3) if has_angles else (max(errors) > 15e-3)


@pytest.mark.parametrize("has_angles", [False, True])
def test_rounding_to_coarse_steps_is_stated(has_angles):
    session = measured("rests")
    rounded = session._replace(strokes=np.rint(session.strokes / STEP) * STEP)
    one = followed(rounded, Settings(stroke_resolution=STEP, scene_error=0.0), has_angles)
    assert 0.3 < math.sqrt(np.mean(one.tip**2 / one.tip2)) < 1.2
    assert math.sqrt(np.mean(one.load**2 / one.load2)) < 1.0
    assert not one.alarms
