"""The bundled session with pump and wind and its predecessor of drives, both synthetic: sensors, truth, what is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from drive_twin import PUMP_DRIVES
from recordings import load_truth, scan

from boom_twin import Stream, replay

SESSION = Path(__file__).parents[2] / "bags" / "pump_session"
BOTH = pytest.mark.parametrize("session", [SESSION, PUMP_DRIVES], ids=["lengths", "drives"])
QUIET = 5.0  # s, before the pump begins


@pytest.fixture(scope="module")
def replayed(tmp_path_factory):
    return replay(PUMP_DRIVES, None, tmp_path_factory.mktemp("replay"))


@pytest.fixture(scope="module")
def replayed_lengths(tmp_path_factory):
    return replay(SESSION, None, tmp_path_factory.mktemp("replay"))


@BOTH
def test_it_is_small_and_says_what_it_is(session):
    assert sum(file.stat().st_size for file in session.iterdir()) < 4e6
    found = scan(session)
    assert "synthetic" in found.notes["origin"] and found.notes["loads"].endswith("pump:0.43:130:0.1@5, wind:15:5")
    assert {topic.name: topic.count for topic in found.topics} == {
        f"/{name}": 8000 for name in ("cylinder_strokes", "joint_angles", "tip_imu", "cylinder_forces")
    }


@BOTH
def test_its_truth_has_the_load(session):
    truth = load_truth(session)
    pump, wind = truth.load[:, 1], truth.load[:, 0]
    assert not pump[truth.times < QUIET].any() and pump.max() == pytest.approx(130.0, abs=0.1)
    begun = truth.times > QUIET
    power = np.abs(np.fft.rfft(pump[begun] - pump[begun].mean())) ** 2
    assert np.fft.rfftfreq(begun.sum(), 0.005)[power.argmax()] == pytest.approx(0.43, abs=0.02)
    assert 7.0 < wind[begun].std() < 25.0


def test_the_estimate_knows_it(replayed):
    """Tip and acceleration from all sensors, with true deviations, and the load: bounds of 2 mm and 0.2 m/s^2, 15 %, 2 %."""
    summary, truth = replayed.summary, load_truth(PUMP_DRIVES)
    assert summary["tip_estimate_error_rms_m"] < 1e-3 < 0.1 * summary["tip_error_rms_m"]
    assert summary["tip_estimate_acceleration_error_rms_m_s2"] < 0.12
    estimates = replayed.recording.whole.estimates
    times = (estimates.stamps - estimates.stamps[0]) * 1e-9 + truth.times[0]
    begun = times > QUIET
    off = (estimates.tip[:, :2] - truth.at(times, truth.position))[begun]
    assert 0.4 < np.sqrt(np.mean(off**2 / estimates.tip_covariance[begun][:, [0, 3]])) < 1.6
    assert summary["tip_load_pulses_N"] == pytest.approx(130.0, rel=0.15)
    assert summary["tip_load_frequency_Hz"] == pytest.approx(0.43, rel=0.02)


def test_residuals_tell_of_the_load(replayed):
    """Angles and forces are farther off once the pump runs; averaged over 1 s, the force of cylinder 1 follows its load."""
    truth, first = load_truth(PUMP_DRIVES), int(replayed.recording.whole.predictions.stamps[0])
    for stream in (Stream.ANGLES, Stream.FORCES):
        rows = replayed.recording.whole.of(stream)
        times = (rows.stamps - first) * 1e-9 + truth.times[0]
        calm, shaken = (np.sqrt(np.nanmean(rows.values[part] ** 2)) for part in (times < QUIET, times > QUIET))
        assert shaken > 1.8 * calm, stream
    load, force = np.interp(times, truth.times, truth.load[:, 1]), rows.values[:, 0]
    slow = np.array([np.convolve(each, np.ones(200) / 200, "same") for each in (load, force)])
    assert np.corrcoef(slow[:, times > QUIET + 1.0])[0, 1] > 0.7


def test_lengths_tell_of_the_load(replayed_lengths):
    """The prediction from lengths alone, and the estimate with true deviations; the pump within 15 %, its rate within 2 %."""
    summary, truth = replayed_lengths.summary, load_truth(SESSION)
    assert summary["samples"] == 8000 and summary["dropped"] == 0 and summary["alarms"] == []
    assert summary["tip_error_rms_m"] < 1.5e-3 and summary["tip_acceleration_error_rms_m_s2"] < 0.4
    assert summary["tip_estimate_error_rms_m"] < 0.8e-3 and summary["tip_estimate_acceleration_error_rms_m_s2"] < 0.12
    estimates = replayed_lengths.recording.whole.estimates
    times = (estimates.stamps - estimates.stamps[0]) * 1e-9 + truth.times[0]
    off = (estimates.tip[:, :2] - truth.at(times, truth.position))[times > QUIET]
    assert 0.4 < np.sqrt(np.mean(off**2 / estimates.tip_covariance[times > QUIET][:, [0, 3]])) < 1.6
    assert summary["tip_load_pulses_N"] == pytest.approx(130.0, rel=0.15)
    assert summary["tip_load_frequency_Hz"] == pytest.approx(0.43, rel=0.02)
