"""Steps ahead of the anchor: their tangents are kept from sample to sample."""

from __future__ import annotations

import numpy as np
import pytest
from drive_twin import drive_twin

from boom_twin import Sample, Settings, Twin, load_scene
from boom_twin.kernels.transfer.kept_tangent import GAIN
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.types import Array, Stream

SCENE = load_scene()


def moving(rate: float, seconds: float, jitter: float) -> tuple[Array, Array]:
    """Stamps (ns) and noisy strokes (m) of two cylinders that go to and fro, one of them at up to 40 mm/s."""
    rng, count = np.random.default_rng(4), round(rate * seconds)
    times = np.arange(count) / rate + rng.uniform(-jitter, jitter, count)
    strokes = strokes_of_posture(SCENE, "arch") + np.outer(0.02 * (1.0 - np.cos(2.0 * times)), [1.0, 0.0, -0.5, 0.0])
    strokes += rng.normal(0.0, 20e-6, strokes.shape)
    return np.round((times + 1.0) * 1e9).astype(np.int64), strokes


def tips(twin: Twin, stamps: Array, strokes: Array, anew: bool = False) -> tuple[Array, Array, Array]:
    """Tip (m), its acceleration (m/s^2) and Newton passes at every sample; `anew` without any tangent of the sample before."""
    rows, passes = [], []
    for stamp, row in zip(stamps.tolist(), strokes, strict=True):
        if anew:
            twin._boom.compiled.tangents.kept[:, GAIN] = 0.0
        report = twin.update(Sample(Stream.STROKES, stamp, row))
        assert report.prediction is not None
        rows.append([*report.prediction.tip_position, *report.prediction.tip_acceleration])
        passes.append(report.passes)
    found = np.array(rows)
    return found[:, :2], found[:, 2:], np.array(passes)


@pytest.mark.parametrize("rate", [50.0, 200.0, 1000.0])
def test_kept_tangents_change_predictions_by_far_less_than_noise_does(rate: float) -> None:
    stamps, strokes = moving(rate, 4.0, 0.02 / rate)
    (tip, acceleration, _), (fresh, accelerated, _) = (tips(drive_twin(SCENE), stamps, strokes, anew) for anew in (False, True))
    assert np.abs(tip - fresh).max() < 2e-5
    assert np.sqrt(np.square(acceleration - accelerated).mean()) < 0.01
    quiet = np.sqrt(np.square(np.diff(accelerated[len(stamps) // 2 :], axis=0)).mean())
    assert 0.0 < np.sqrt(np.square(acceleration - accelerated).mean()) < 0.2 * quiet


def test_kept_tangents_are_those_of_most_passes() -> None:
    """A pass with a kept tangent does not make condensed matrices anew: gains of the first joint are those of long ago."""
    stamps, strokes = moving(200.0, 4.0, 1e-4)
    twin, changes, before = drive_twin(SCENE), 0, None
    for stamp, row in zip(stamps.tolist(), strokes, strict=True):
        twin.update(Sample(Stream.STROKES, stamp, row))
        gains = twin._boom.compiled.tangents.condensed.gains[0].copy()
        changes, before = changes + (before is not None and not np.array_equal(gains, before)), gains
    assert changes < 0.3 * len(stamps)


def test_a_boom_that_started_anew_is_predicted_as_by_a_new_twin() -> None:
    """Tangents of before a start from rest are forgotten."""
    stamps, strokes = moving(200.0, 2.0, 1e-4)
    twin, other = drive_twin(SCENE, Settings()), drive_twin(SCENE, Settings())
    tips(twin, stamps, strokes)
    twin.reset()
    later = stamps + 20_000_000_000
    again, first = tips(twin, later, strokes), tips(other, later, strokes)
    assert all(np.array_equal(a, b) for a, b in zip(again, first, strict=True))
