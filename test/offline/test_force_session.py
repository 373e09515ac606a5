"""Measured cylinder forces: from a message to residual, zero, alarm and page."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from command import main
from default_boom import strokes_of_posture
from drive_twin import drive_twin, note_drives
from recordings import read, scan, write_samples

from boom_twin import BagError, Sample, Settings, Stream, load_scene, replay
from boom_twin.monitor.data.bag_feed import bag_feed
from boom_twin.monitor.protocol import layout

MS, START, COUNT = 1_000_000, 1_700_000_000_000_000_000, 800
FORCES, WRONG, SIGMA = Stream.FORCES, 1500.0, 100.0
CHANNELS = tuple(f"cylinder_force_{i}" for i in range(1, 5))
JOINT_STATE = "sensor_msgs/msg/JointState"


@pytest.fixture(scope="module")
def scene():
    return load_scene()


@pytest.fixture(scope="module")
def samples(scene):
    """Of a gentle move; the force of cylinder 2 reads `WRONG` too much, all have a noise of `SIGMA`."""
    still, noise, model, found = strokes_of_posture(scene, "arch"), np.random.default_rng(4), drive_twin(scene), []
    for stamp in (START + 5 * MS * np.arange(COUNT)).tolist():
        strokes = still + 0.01 * math.sin(1.5e-9 * (stamp - START)) * np.array([1.0, 0.0, 0.5, 0.0])
        p = model.update(Sample(Stream.STROKES, stamp, strokes)).prediction
        forces = p.cylinder_forces + SIGMA * noise.standard_normal(4) + WRONG * np.array([0.0, 1.0, 0.0, 0.0])
        joints = p.joints + 1e-4 * noise.standard_normal(4)
        found += [Sample(Stream.STROKES, stamp, strokes), Sample(Stream.ANGLES, stamp, joints), Sample(FORCES, stamp, forces)]
    return found


@pytest.fixture(scope="module")
def bag(samples, tmp_path_factory):
    path = tmp_path_factory.mktemp("forces") / "bag"
    write_samples(path, samples, (Stream.STROKES, Stream.ANGLES, FORCES), {"origin": "synthetic, a test"})
    note_drives(path)
    return path


def test_residuals_and_zeros(scene, samples):
    twin, found, alarms = drive_twin(scene, health=True), [], set()
    for sample in samples:
        report = twin.update(sample)
        found += [residuals for residuals in report.residuals if residuals.stream is FORCES]
        alarms |= {alarm.cause for alarm in (report.health.alarms if report.health else ())}
    assert len(found) == COUNT and {residuals.names for residuals in found} == {CHANNELS} and not alarms
    values = np.array([residuals.values for residuals in found])
    assert values.mean(axis=0) == pytest.approx([0.0, WRONG, 0.0, 0.0], abs=20.0)
    assert values.std(axis=0) == pytest.approx(SIGMA, rel=0.15)
    assert np.all(np.array([residuals.sigmas for residuals in found]) >= SIGMA)
    assert twin.rezero("cylinder_force_2") == {"cylinder_force_2": pytest.approx(WRONG, abs=40.0)}


def test_a_stuck_or_silent_sensor_is_told_and_a_shaken_boom_is_not(scene, samples):
    """A load that the model does not know changes a force by far more than its noise, from one reading to the next."""
    known = set()
    twin = drive_twin(scene, health=True)
    stuck, last = 0.0, samples[-1].stamp
    for sample in samples:
        if sample.stream is FORCES:
            values = sample.values + 2e3 * math.sin(8e-9 * (sample.stamp - START)) ** 9
            if sample.stamp < last - 2_000 * MS:
                stuck = values[0]
            else:
                values[[0, 2]] = stuck, math.nan
            sample = Sample(FORCES, sample.stamp, values)
        health = twin.update(sample).health
        known |= {(alarm.kind, alarm.cause) for alarm in (health.alarms if health else ())}
    assert known == {("stuck", "cylinder_force_1.sensor"), ("dropout", "cylinder_force_3.sensor")}


def test_replay_report_and_page(scene, bag, tmp_path):
    assert main(["replay", str(bag), "--out", str(tmp_path / "out"), "--report"]) == 0
    kept = read(scan(tmp_path / "out" / "bag"), {"/boom_twin/residuals": JOINT_STATE})
    kept = np.array([msg.position for _, _, msg in kept if msg.name == list(CHANNELS)])
    assert len(kept) == COUNT and kept[:, 1].mean() == pytest.approx(WRONG, abs=20.0)
    rows = json.loads((tmp_path / "out" / "quantities.json").read_text())["quantities"]
    (mean,) = (row for row in rows if row["name"] == "residual_mean_cylinder_force_2")
    assert mean["value"] == pytest.approx(WRONG, abs=20.0) and mean["unit"] == "N"
    feed = bag_feed(bag, scene, Settings())
    while feed.is_reading:
        feed.poll()
    (table,) = (each for each in layout(feed.store)["tables"] if each["name"] == FORCES.value)
    assert table["columns"] == tuple(f"{name}_{end}" for end in ("N", "normalised") for name in CHANNELS)
    assert table["residuals"] == {"title": "cylinder forces", "factor": 1.0, "unit": "N"}


def test_forces_of_another_boom_are_refused(scene, samples, tmp_path):
    others = [Sample(FORCES, e.stamp, np.append(e.values, 0.0)) if e.stream is FORCES else e for e in samples[:300]]
    write_samples(tmp_path / "bag", others, (Stream.STROKES, Stream.ANGLES, FORCES), {"origin": "synthetic, a test"})
    with pytest.raises(BagError, match=r"/cylinder_forces names cylinder_5; .* so this is another boom"):
        replay(tmp_path / "bag", scene, tmp_path / "out")
