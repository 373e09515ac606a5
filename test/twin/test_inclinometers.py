"""Inclinometers: compared with the predicted angle of their section, and driving the boom (synthetic)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from convergence.balances import states_of
from default_boom import EXACT, strokes_of_posture
from drive_twin import drive_twin
from session_readings import samples_in

from boom_twin import Sample, Settings, Stream, Twin, load_scene
from boom_twin.analysis.simulate import course_of
from boom_twin.deviation.sensor_model import TURN, mounting_of
from boom_twin.scene.pump_pulses import ease, pump_pulses
from boom_twin.types import StrokeReading

MS = 1_000_000
ARCH = Path(__file__).parents[2] / "bags" / "arch_session"


@pytest.fixture(scope="module")
def scene():
    return load_scene()


def readings(scene, mounts, count=1):
    """Predicted joint angles and tip angle at rest, and what the sensors should read: measured zero minus residual."""
    twin = drive_twin(scene, Settings(), mounts)
    report = twin.update(Sample(Stream.STROKES, MS, strokes_of_posture(scene, "arch")))
    residuals = twin.update(Sample(Stream.ANGLES, MS, np.zeros(len(scene.joints)))).residuals[0]
    return report.prediction, -residuals.values, residuals.sigmas


def is_turn(difference):
    return np.abs(difference - TURN * np.round(difference / TURN)) < 1e-12


def test_roots_and_heads_chain_up(scene):
    """The head of a section plus the angle of the next joint is the root of the next section; the last head is the tip's."""
    prediction, roots, _ = readings(scene, ["root"] * 4)
    _, heads, _ = readings(scene, ["head"] * 4)
    _, mixed, _ = readings(scene, [None, "head", None, "root"])
    assert is_turn(roots[0] - prediction.joints[0])
    assert np.all(is_turn(heads[:-1] + prediction.joints[1:] - roots[1:]))
    assert is_turn(heads[-1] - prediction.tip_angle)
    assert np.all(np.abs(heads - roots) > 1e-5), "sections that bend have two ends"
    assert mixed == pytest.approx([prediction.joints[0], heads[1], prediction.joints[2], roots[3]], abs=1e-12)


def test_an_inclined_base_is_in_the_reading(scene):
    tilted = scene.model_copy(update={"base": scene.base.model_copy(update={"inclination": 0.1})})
    prediction, found, _ = readings(tilted, ["root", None, None, "head"])
    assert found[0] == pytest.approx(prediction.joints[0] + 0.1, abs=1e-12)
    assert is_turn(found[3] - prediction.tip_angle - 0.1)


@pytest.mark.parametrize("mount", ["head", "head_compensated"])
def test_an_inclinometer_at_the_tip_of_the_bundled_session(scene, mount):
    """Angle of the last head and acceleration there, from an independent code, with the noise of the session's encoders.

    One that is not compensated takes the direction of its specific force for the vertical: it is off by up to 8 deg.
    """
    truth = np.genfromtxt(ARCH / "truth.csv.gz", delimiter=",", names=True)
    read_angles = truth["tip_angle_rad"].copy()
    if mount == "head":
        sway = np.arctan2(truth["tip_ax_m_s2"], -scene.gravity[1] + truth["tip_ay_m_s2"])
        assert np.degrees(np.abs(sway).max()) > 5.0
        read_angles += sway
    noise = np.random.default_rng(5).normal(0.0, Settings().angle_sigma, len(truth))
    twin, found = Twin(scene, Settings(), [None, None, None, mount]), []
    rows = 4000
    for row, sample in enumerate(samples_in(ARCH, [Stream.STROKES])[:rows]):
        twin.update(sample)
        angles = np.full(4, np.nan)
        angles[3] = read_angles[row] + noise[row]
        found += [residuals.normalised[3] for residuals in twin.update(Sample(Stream.ANGLES, sample.stamp, angles)).residuals]
    assert len(found) == rows
    least = 0.2 if mount == "head" else 0.6  # a share of the error by acceleration is stated as not known
    assert abs(np.mean(found)) < 0.4 and least < np.std(found) < 1.15


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
    frames = np.array([course.start.frames.copy(), *(state.frames.copy() for _, state in states_of(course, STEP))])
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
    twin, off = Twin(SCENE, EXACT, mounts=mounts, reads=StrokeReading.ANGLE), []
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
