"""Accuracy by sensors: more of them never make it worse, and what is stated is what the twin's own filter comes to."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from boom_twin import Sample, Stream, Twin, load_scene, statics
from boom_twin.cli.accuracy import sensors_of, sets_of
from boom_twin.deviation.accuracy import TipAccuracy, accuracy_at
from boom_twin.errors import UsageError
from boom_twin.scene.kinematics import strokes_of_posture

SCENE = load_scene()
ARCH = strokes_of_posture(SCENE, "arch")
SETS = ([], [Stream.ANGLES], [Stream.ANGLES, Stream.IMU], [Stream.ANGLES, Stream.IMU, Stream.IMU])


@pytest.fixture(scope="module")
def found() -> list[TipAccuracy]:
    return [accuracy_at(SCENE, ARCH, chosen) for chosen in SETS]


def test_more_sensors_are_never_worse(found: list[TipAccuracy]) -> None:
    for fewer, more in pairwise(found):
        for before, after in zip(fewer, more, strict=True):
            assert (after <= before * 1.1).all()
    assert np.hypot(*found[2].acceleration) < 0.25 * np.hypot(*found[1].acceleration), "an IMU tells how it accelerates"


def test_it_is_what_a_twin_comes_to() -> None:
    """The same sensors on a twin whose size of the unknown load is held, after 10 s of readings of a boom at rest."""
    stated, twin = accuracy_at(SCENE, ARCH, [Stream.ANGLES]), Twin(SCENE)
    rng, rest, estimates = np.random.default_rng(1), statics(SCENE, strokes=ARCH), []
    for k in range(4000):
        report = twin.update(Sample(Stream.STROKES, 5_000_000 * k, rest.lengths + 2e-5 * rng.normal(size=4)))
        assert report.estimate is not None
        twin._boom.filters.load2[:] = twin._boom.filters.noise.usual_load**2
        twin.update(Sample(Stream.ANGLES, 5_000_000 * k, rest.joints + 1.745e-4 * rng.normal(size=4)))
        estimates.append(report.estimate.tip_covariance[[0, 3, 5]])
    assert np.sqrt(np.mean(estimates[2000:], axis=0)) == pytest.approx(stated.tip, rel=0.15)  # learnt noise adds to it


def test_names_of_sensors() -> None:
    assert sensors_of("angles, imu,imu") == [Stream.ANGLES, Stream.IMU, Stream.IMU]
    assert len(sets_of([Stream.ANGLES, Stream.IMU, Stream.IMU])) == 6
    with pytest.raises(UsageError, match="'radar' is no sensor"):
        sensors_of("angles,radar")
