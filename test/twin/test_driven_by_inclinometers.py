"""A boom driven by inclinometers at the roots or heads of all sections, through moves and under pump pulses (synthetic).

The motion is that of `simulate`; accelerations of the inclinometers' places are differences of its positions.
"""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture

from boom_twin import Sample, Stream, Twin, load_scene
from boom_twin.analysis.simulate import course_of
from boom_twin.deviation.sensor_model import mounting_of
from boom_twin.scene.pump_pulses import ease, pump_pulses
from boom_twin.types import StrokeReading

SCENE, STEP, EVERY = load_scene(), 1.25e-3, 4
SIGMA = 1.745e-4  # rad
MOST = {"root": 9e-3, "head": 9e-3, "root_compensated": 1e-3, "head_compensated": 1e-3}  # m


@pytest.fixture(scope="module")
def motion():
    """Return the plan, the frames of the chain at every step, and the times of the rows."""
    times = np.arange(0.0, 12.0, STEP * EVERY)
    strokes = np.tile(strokes_of_posture(SCENE, "arch"), (len(times), 1))
    strokes[:, [0, 2]] += ease(np.clip((times - 3.0) / 3.0, 0.0, 1.0))[:, None] * [0.05, 0.03]
    push = 130.0 * pump_pulses(times, 0.43, 0.1) * ease(np.clip((times - 5.0) / 0.3, 0.0, 1.0))
    course = course_of(SCENE, times, strokes, STEP, force=np.column_stack([np.zeros_like(push), push]))
    frames = np.array([course.start.frames.copy(), *(state.frames.copy() for _, state in course.states(STEP))])
    return course.plan, frames, times


@pytest.mark.parametrize("mount", MOST)
def test_the_tip_follows(motion, mount):
    """The stated deviation tells what inclinometers that are not compensated do not know."""
    plan, frames, times = motion
    mounts, noise = (mount,) * 4, np.random.default_rng(3)
    places = frames[:, mounting_of(plan, mounts).frames]
    read = places[:, :, 2].copy()
    if mount in ("root", "head"):
        acceleration = np.diff(places[:, :, :2], 2, axis=0, prepend=places[:1, :, :2], append=places[-1:, :, :2]) / STEP**2
        read += np.arctan2(acceleration[..., 0], -SCENE.gravity[1] + acceleration[..., 1])
    twin, off = Twin(SCENE, mounts=mounts, reads=StrokeReading.ANGLE), []
    turns = 2.0 * np.pi * np.array([0, 1, -1, 2])  # that count on: readings are the same
    rows = list(zip(times, read[::EVERY], frames[::EVERY, -1, :2], strict=True))
    for at, row, true in rows[:-1]:  # the last has no acceleration
        values = row + noise.normal(0.0, SIGMA, 4) + turns
        report = twin.update(Sample(Stream.ANGLES, 10**9 + round(at * 1e9), values))
        off.append([report.prediction.tip_position - true, np.sqrt(report.estimate.tip_covariance[[0, 3]])])
    error, stated = np.array(off)[1:].swapaxes(0, 1)
    assert not twin.counts
    assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < MOST[mount]
    assert 0.3 < np.sqrt(np.mean((error / stated) ** 2)) < 1.6
