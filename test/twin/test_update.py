"""Samples in blocks cause what they cause one by one, whatever is odd about them."""

from __future__ import annotations

import pickle
from collections.abc import Callable

import numpy as np
import pytest
from default_boom import strokes_of_posture
from drive_twin import drive_twin

from boom_twin import Report, Sample, Settings, Stream, Twin, load_scene
from boom_twin.twin.blocks import SampleBlock, block_of

MS, N = 1_000_000, 4
START = 1_700_000_000_000 * MS


def stream(seed: int, count: int = 900, strange: float = 0.02, new: Callable[..., Twin] = drive_twin) -> list[Sample]:
    """All streams at 200 Hz of a boom that moves: late, missing, doubled, far off, of other times."""
    rng, scene = np.random.default_rng(seed), load_scene()
    still = strokes_of_posture(scene, "arch")
    twin, found, shift = new(scene), [], 0
    for k in range(count):
        stamp = START + 5 * k * MS + int(rng.normal() * 0.05 * MS)
        strokes = still + 0.01 * np.sin(0.004 * k) * np.array([1.0, 0.0, 1.0, 0.5]) + rng.normal(size=N) * 2e-5
        prediction = twin.update(Sample(Stream.STROKES, stamp, strokes)).prediction
        joints = prediction.joints + rng.normal(size=N) * 2e-4
        own = [(Stream.STROKES, strokes), (Stream.ANGLES, joints), (Stream.IMU, rng.normal(size=2) * 0.05 + (0.0, 9.8))]
        own.append((Stream.FORCES, prediction.cylinder_forces + 100.0 * rng.normal(size=N)))
        for kind, values in own:
            if rng.random() < strange:
                values = values.copy()
                values[rng.integers(len(values))] = rng.choice([np.nan, np.inf, 1e9, values[0] + 0.3])
            if rng.random() < strange / 10:
                shift += int(rng.choice([-900, -3, 250, 700, 7000])) * MS
            if rng.random() > strange / 4:
                found.append(Sample(kind, stamp + shift + int(rng.random() < strange / 4) * 300 * MS, values))
    for k in rng.integers(0, len(found) - 40, size=int(strange * len(found))).tolist():
        other = k + int(rng.integers(1, 40))
        found[k], found[other] = found[other], found[k]
    return found


def told(reports: list[Report]) -> list[tuple[object, ...]]:
    """Everything in reports but the Newton passes, which blocks do not give."""
    found: list[tuple[object, ...]] = []
    for report in reports:
        p, health = report.prediction, report.health
        numbers = () if p is None else (
            p.stamp, p.tip_angle, p.tip_angular_velocity, p.tip_angular_acceleration,
            *(None if each is None else each.tobytes() for each in (
                p.tip_position, p.tip_displacement, p.tip_velocity, p.tip_acceleration, p.joints, p.strokes,
                p.cylinder_forces, p.shape, p.undeflected, p.pins, p.clearances, p.moments)),
        )  # fmt: skip
        residuals = [(r.stream, r.stamp, r.names, r.values.tobytes(), r.sigmas.tobytes()) for r in report.residuals]
        level = None if health is None else (health.stamp, health.alarms, health.tip_sigmas.tobytes())
        said = report.stamp, report.accepted, report.events, report.status, report.change
        found.append((*said, numbers, residuals, level, report.estimate and pickle.dumps(report.estimate)))
    return found


@pytest.mark.parametrize("new", [drive_twin, Twin], ids=["drives", "lengths"])
@pytest.mark.parametrize("seed", range(4))
def test_blocks_of_any_size_give_what_single_samples_give(seed: int, new: Callable[..., Twin]) -> None:
    rng = np.random.default_rng(100 + seed)
    samples = stream(seed, strange=0.0 if seed == 0 else 0.02, new=new)
    mounts = ("root", None, "head", "root") if seed == 1 else ()
    usual = seed < 3
    one, many = (new(load_scene(), Settings(), mounts, usual) for _ in range(2))
    first = 0
    while first < len(samples):
        part = samples[first : first + int(rng.integers(1, 500))]
        if rng.random() < 0.2:
            asked, zeros = {"payload": float(rng.integers(0, 60))}, {"joint_2": float(rng.normal() * 1e-3)}
            for twin in (one, many):
                twin.requests.tune(asked)
                twin.requests.zero(zeros)
        reports = many.take(block_of(part, N)).reports(N)
        assert told(reports) == told([one.update(sample) for sample in part])
        first += len(part)
    assert one.counts == many.counts
    assert seed == 0 or len(one.counts) > 5


@pytest.mark.parametrize("seed", range(2))
def test_predictions_from_lengths_know_nothing_of_what_else_is_measured(seed: int) -> None:
    """Late, early, lost, doubled or absurd: angles, accelerations and forces change no number of the prediction."""
    rng, samples = np.random.default_rng(seed), stream(seed, 300, strange=0.0, new=Twin)
    alone = [sample for sample in samples if sample.stream is Stream.STROKES]
    keys = [sample.stamp + 0.5 * MS + (sample.stream is not Stream.STROKES) * rng.normal() * 20 * MS for sample in samples]
    mixed = [sample for _, sample in sorted(zip(keys, samples, strict=True), key=lambda each: each[0])]
    others = [sample for sample in mixed if sample.stream is Stream.STROKES or rng.random() < 0.9]
    others = [
        each for sample in others for each in [sample] * (1 + (sample.stream is not Stream.STROKES and rng.random() < 0.1))
    ]

    def predictions(given: list[Sample]) -> list[object]:
        twin = Twin(load_scene(), health=True)
        return [row[5] for row in told([twin.update(sample) for sample in given]) if row[5]]

    assert predictions(alone) == predictions(samples) == predictions(mixed) == predictions(others)


def test_arrays_of_another_layout_and_kind_are_taken_as_what_they_say() -> None:
    """The compiled update does not look at types again: a block in columns, and of small numbers, is put right before."""
    strokes = strokes_of_posture(load_scene(), "arch")
    stamps = 10**18 + 5_000_000 * np.arange(40)
    values = strokes + 1e-3 * np.sin(0.1 * np.arange(40))[:, None] * np.ones(4)
    streams = np.zeros(40, np.int64)
    rows = [SampleBlock(streams, stamps, values)]
    others = [SampleBlock(streams.astype(np.int8), np.repeat(stamps, 2)[::2], np.asfortranarray(values))]
    tips = [drive_twin(load_scene()).take(block).predictions.tip_acceleration for (block,) in (rows, others)]
    assert len(tips[0]) == 40 and tips[0].tobytes() == tips[1].tobytes()
