"""Booms without stroke transducers: the bundled sessions, which are synthetic, with their strokes left out."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import main
from default_boom import EXACT
from offline.by_the_node import assert_same_bytes
from recordings import load_mapping, load_truth, write_samples
from session_readings import samples_in

from boom_twin import BagError, Sample, Stream, Twin, replay
from boom_twin.types import StrokeReading

BAGS = Path(__file__).parents[2] / "bags"
MOST = {"arch_session": 2e-3, "pump_session": 3e-3}  # m


@pytest.fixture(scope="module")
def mapping(tmp_path_factory):
    path = tmp_path_factory.mktemp("mapping") / "angles.yaml"
    path.write_text("drive: angles\n")
    return path


@pytest.fixture(scope="module", params=list(MOST))
def without_strokes(request, tmp_path_factory):
    folder, source = tmp_path_factory.mktemp("sessions") / request.param, BAGS / request.param
    streams = [Stream.ANGLES, Stream.IMU]
    write_samples(folder, samples_in(source, streams), streams, {"origin": "synthetic"})
    shutil.copy(source / "truth.csv.gz", folder)
    return folder


def test_the_tip_follows_the_truth(without_strokes, mapping, tmp_path):
    """Prediction from angles alone; the estimate with the IMU, and its stated deviation; joint residuals are innovations."""
    found = replay(without_strokes, None, tmp_path / "out", EXACT, mapping=mapping)
    summary, truth, most = found.summary, load_truth(without_strokes), MOST[without_strokes.name]
    assert summary["strokes"] == "angle" and summary["strokes_source"].endswith("angles.yaml, drive")
    assert summary["samples"] == len(truth.times) and summary["dropped"] == 0 and summary["alarms"] == []
    assert summary["tip_error_rms_m"] < 0.6 * most and summary["tip_estimate_error_rms_m"] < 0.6 * most
    assert summary["tip_estimate_acceleration_error_rms_m_s2"] < 0.1
    assert np.all(np.abs(np.array(summary["joint_residual_normalised_std"]) - 1.0) < 0.15)
    assert np.all(np.abs(summary["joint_residual_normalised_mean"]) < 0.1)
    estimates = found.recording.whole.estimates
    times = (estimates.stamps - estimates.stamps[0]) * 1e-9 + truth.times[0]
    off = estimates.tip[:, :2] - truth.at(times, truth.position)
    assert 0.6 < np.sqrt(np.mean(off**2 / estimates.tip_covariance[:, [0, 3]])) < 2.0
    assert found.recording.whole.residuals_of(Stream.STROKES).values.size == 0


def test_a_replay_gives_what_the_node_does(without_strokes, mapping, tmp_path):
    """A second of it."""
    replay(without_strokes, None, tmp_path / "out", mapping=mapping)
    assert_same_bytes(without_strokes, tmp_path / "out", load_mapping(mapping, 4), StrokeReading.ANGLE, 2000)


def test_without_the_mapping_the_remedy_is_told(without_strokes, mapping, tmp_path, capsys):
    with pytest.raises(BagError, match=r"no strokes .*, but .* of /joint_angles.* write `drive: angles`"):
        replay(without_strokes, None, tmp_path / "out")
    assert main(["info", str(without_strokes)]) == 0 and "`drive: angles`" in capsys.readouterr().out
    assert main(["info", str(without_strokes), "--mapping", str(mapping)]) == 0
    told = capsys.readouterr().out
    assert "replay     nothing is missing" in told and "are not read: angles drive the model" in told


@pytest.mark.parametrize("factor", [180.0 / np.pi, -1.0])
def test_angles_that_do_not_fit_are_told(factor, mapping, tmp_path):
    """A CSV file without strokes."""
    angles = np.array([each.values for each in samples_in(BAGS / "arch_session", [Stream.ANGLES])[:400]])
    rows = np.column_stack([0.005 * np.arange(len(angles)), factor * angles])
    csv = tmp_path / "session.csv"
    np.savetxt(csv, rows, delimiter=",", header="t_s," + ",".join(f"joint_{i}_rad" for i in range(1, 5)), comments="")
    with pytest.raises(BagError, match=r"no angle sample could be used .* names joint_1..4.* can read .*units .* by --mapping"):
        replay(csv, None, tmp_path / "out", mapping=mapping)


def test_a_boom_that_strokes_do_not_drive_leaves_them_out():
    """Strokes that come all the same are counted; the zero of an angle that drives is none that a residual could give."""
    twin = Twin(reads=StrokeReading.ANGLE)
    angles, strokes = (samples_in(BAGS / "arch_session", [stream])[:50] for stream in (Stream.ANGLES, Stream.STROKES))
    for one, other in zip(angles, strokes, strict=True):
        assert twin.update(one).prediction is not None
        assert not twin.update(other).accepted
    assert twin.counts == {"not used": 50}
    assert twin.update(Sample(Stream.ANGLES, angles[-1].stamp + 5_000_000, np.full(4, np.nan))).prediction is None


def test_an_imu_elsewhere_goes_with_angles(tmp_path):
    """The readings of the tip IMU, as those of another one that the mapping places there."""
    folder, mapping = tmp_path / "session", tmp_path / "mapping.yaml"
    samples = samples_in(BAGS / "pump_session", [Stream.ANGLES, Stream.IMU])
    placed = [replace(each, stream=Stream.IMU_2) if each.stream is Stream.IMU else each for each in samples]
    write_samples(folder, placed, [Stream.ANGLES, Stream.IMU_2], {"origin": "synthetic"})
    shutil.copy(BAGS / "pump_session" / "truth.csv.gz", folder)
    mapping.write_text("drive: angles\ninputs: {imu_2: {place: {}}}\n")
    found = replay(folder, None, tmp_path / "out", mapping=mapping)
    assert found.summary["tip_estimate_acceleration_error_rms_m_s2"] < 0.1 and found.summary["alarms"] == []
    assert np.nanstd(found.recording.whole.residuals_of(Stream.IMU_2).values) > 0.0
