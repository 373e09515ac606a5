"""Streams whose readings arrive late: the filter against the one that has all readings in order, and a session of the rig."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from default_boom import strokes_of_posture
from deviation.test_models import transition_of
from session_readings import samples_in

from boom_twin import Sample, Settings, Stream, Twin, load_scene, statics
from boom_twin.deviation.channels import measurement_row
from boom_twin.deviation.delayed import begin_instant, copy_reading, delayed_row, note_lateness
from boom_twin.deviation.kalman import correct, make_transition, transit
from boom_twin.deviation.predictor import BoomPredictor
from boom_twin.deviation.rows import length_row
from boom_twin.deviation.states import ALL_VALVES, FED, PREDICTION, all_states
from boom_twin.predictions import Estimate
from boom_twin.types import Array

SCENE = load_scene()
N, STEP, LATE = len(SCENE.sections), 5_000_000, 7  # ns; steps
LENGTH2, LOADS = 4e-10, np.array([400.0, 900.0])  # m^2, N^2


def corrected(x: Array, covariance: Array, row: Array, value: float, variance: float) -> tuple[Array, Array]:
    """One reading by the textbook, in Joseph's form."""
    gain = covariance @ row / (row @ covariance @ row + variance)
    left = np.eye(len(x)) - np.outer(gain, row)
    return x + gain * (value - row @ x), left @ covariance @ left.T + variance * np.outer(gain, gain)


def test_late_readings_give_the_estimate_of_all_readings_in_their_order() -> None:
    """Lengths in time, angles and IMU seven steps late; the oracle takes each reading at its own step."""
    boom = BoomPredictor(SCENE, Settings())
    boom.start(statics(SCENE, strokes_of_posture(SCENE, "arch")).lengths)
    p, f, h, rng = boom.posture, boom.filters, 1e-9 * STEP, np.random.default_rng(5)
    f.status[FED], f.felt[:], f.mean[PREDICTION] = 1, 9.81, 0.0
    streams = {int(row.stream): 0.0 for row in p.channels if list(Stream)[row.stream] in (Stream.ANGLES, Stream.IMU)}
    late = [c for c, row in enumerate(p.channels) if row.stream in streams]
    for stream in streams:
        own = np.flatnonzero(p.channels.stream == stream)
        note_lateness(p, f, stream, int(own[0]), int(own[-1]) + 1, LATE * h)
    size = all_states(p)
    make_transition(p, f, h)
    transition = transition_of(p, f, size)
    rows = np.zeros((N + len(late), f.x.shape[1]))
    for i in range(N):
        length_row(p, i, rows[i])
    for row, c in zip(rows[N:], late, strict=True):
        measurement_row(p, f, c, row)
        row[size - p.behind[0] + p.channels[c].zero] = 1.0
    variances = np.append(np.full(N, LENGTH2), p.channels.noise2[late])
    x, covariance = f.x[ALL_VALVES, :size].copy(), f.p[ALL_VALVES, :size, :size].copy()
    f.p[ALL_VALVES] = 0.0
    transit(p, f, ALL_VALVES, size, h, LOADS, 0.0)
    noise = f.p[ALL_VALVES, :size, :size].copy()
    f.x[ALL_VALVES, :size], f.p[ALL_VALVES, :size, :size] = x, covariance

    steps, gains = 60, f.gains[0]
    values = rows[:, :size] @ x + rng.normal(size=(steps, len(rows))) * 5.0 * np.sqrt(variances)
    for k in range(steps):
        x, covariance = transition @ x, transition @ covariance @ transition.T + noise
        for j in range(len(rows) if k < steps - LATE else N):
            x, covariance = corrected(x, covariance, rows[j, :size], values[k, j], variances[j])
    for k in range(steps):
        make_transition(p, f, h)
        transit(p, f, ALL_VALVES, all_states(p), h, LOADS, 0.0)
        for j in range(N):
            innovation = values[k, j] - rows[j] @ f.x[ALL_VALVES]
            correct(f.x[ALL_VALVES], f.p[ALL_VALVES], rows[j], gains, innovation, variances[j], all_states(p))
        first = begin_instant(p, f, k * STEP)
        for j, c in enumerate(late, start=N):
            f.row[:] = rows[j]
            copy_reading(p, f, first + f.copies[c], 0.0)
        for j, c in enumerate(late, start=N):
            if k >= LATE:
                assert delayed_row(p, f, c, (k - LATE) * STEP, f.row, f.rows[2])[0] > 0.0
                innovation = values[k - LATE, j] - f.row @ f.x[ALL_VALVES]
                correct(f.x[ALL_VALVES], f.p[ALL_VALVES], f.row, gains, innovation, variances[j], all_states(p))
    sigmas = np.sqrt(covariance.diagonal())
    known = sigmas > 0.0
    assert ((f.x[ALL_VALVES, :size] - x) / sigmas)[known] == pytest.approx(np.zeros(known.sum()), abs=1e-6)
    scale = np.outer(sigmas, sigmas)[np.ix_(known, known)]
    assert f.p[ALL_VALVES, :size, :size][np.ix_(known, known)] / scale == pytest.approx(
        covariance[np.ix_(known, known)] / scale, abs=1e-6
    )


def test_readings_between_slow_strokes_err_by_the_interpolation_as_stated() -> None:
    """Strokes at 5 Hz, angles and IMU at 200 Hz, against strokes at 200 Hz."""
    samples = samples_in(Path(__file__).parents[2] / "bags" / "arch_session", seconds=20.0)
    kept = {each.stamp for each in [each for each in samples if each.stream is Stream.STROKES][::40]}
    slow = estimates([each for each in samples if each.stream is not Stream.STROKES or each.stamp in kept])
    right = estimates(samples)
    off = np.array([slow[stamp].tip - right[stamp].tip for stamp in slow])[:, :2]
    stated = np.array([each.tip_covariance[[0, 3]] for each in slow.values()])
    assert np.square(off).mean() < stated.mean()


def estimates(samples: list[Sample]) -> dict[int, Estimate]:
    """Estimates of a twin by stamp."""
    twin = Twin(SCENE, Settings(gap=1.0))
    reports = [twin.update(sample) for sample in samples]
    return {each.stamp: each.estimate for each in reports if each.estimate is not None}


def test_the_estimate_takes_the_angle_in_the_place_of_a_stroke_transducer_that_jumps() -> None:
    """The boom stands still. From 2 s on cylinder 2 reads 3 mm too much. Angles are 0.2 ms late, so they are of copies."""
    rest, rng, samples = statics(SCENE, strokes_of_posture(SCENE, "arch")), np.random.default_rng(8), list[Sample]()
    for k in range(800):
        lengths = rest.lengths + 2e-5 * rng.normal(size=N)
        lengths[1] += 0.003 if k >= 400 else 0.0
        samples.append(Sample(Stream.STROKES, k * STEP, lengths))
        samples.append(Sample(Stream.ANGLES, k * STEP + 200_000, rest.joints + np.radians(0.01) * rng.normal(size=N)))
    twin = Twin(SCENE, health=True, causes=False)
    reports = [twin.update(sample) for sample in samples]
    found = [each.estimate for each in reports if each.estimate is not None]
    away = np.array([each.tip[:2] - rest.tip for each in found])
    sigmas = np.sqrt([each.tip_covariance[[0, 3]] for each in found])
    assert len(found) > 700
    assert sigmas.max() > 0.5 and sigmas[-1].max() < 0.02  # the transducer is left out, the angle replaces it
    assert np.abs(away).max() < 0.02
    assert np.abs(away / sigmas).max() < 4.0
