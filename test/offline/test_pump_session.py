"""The bundled session with pump and wind and its predecessor of drives, both synthetic: sensors, truth, what is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from default_boom import EXACT
from drive_twin import PUMP_DRIVES
from recordings import load_truth, scan
from session_readings import samples_in

from boom_twin import Stream, Twin, load_scene, replay
from boom_twin.twin.blocks import block_of

SESSION = Path(__file__).parents[2] / "bags" / "pump_session"
SESSIONS = {"lengths": SESSION, "drives": PUMP_DRIVES}
TIP, ESTIMATE = {"lengths": 1.5e-3, "drives": 0.05}, {"lengths": 0.8e-3, "drives": 1e-3}  # m, most that the errors may be
QUIET = 5.0  # s, before the pump begins


@pytest.fixture(scope="module", params=SESSIONS)
def kind(request):
    return request.param


def test_its_truth_has_the_load(kind):
    assert sum(file.stat().st_size for file in SESSIONS[kind].iterdir()) < 4e6
    notes = scan(SESSIONS[kind]).notes
    assert "synthetic" in notes["origin"] and notes["loads"].endswith("pump:0.43:130:0.1@5, wind:15:5")
    truth = np.genfromtxt(SESSIONS[kind] / "truth.csv.gz", delimiter=",", names=True)
    pump, wind, times = truth["tip_load_y_N"], truth["tip_load_x_N"], truth["t_s"]
    assert not pump[times < QUIET].any() and pump.max() == pytest.approx(130.0, abs=0.1)
    begun = times > QUIET
    power = np.abs(np.fft.rfft(pump[begun] - pump[begun].mean())) ** 2
    assert np.fft.rfftfreq(begun.sum(), 0.005)[power.argmax()] == pytest.approx(0.43, abs=0.02)
    assert 7.0 < wind[begun].std() < 25.0


@pytest.mark.parametrize("more", [(Stream.IMU,), (Stream.ANGLES, Stream.IMU)])
def test_an_imu_makes_no_estimate_worse(more):
    """The pump begins at 5 s. What the IMU adds must not be taken for valves that open."""
    truth, found = load_truth(SESSION), []
    for streams in ((Stream.STROKES,), (Stream.STROKES, *more)):
        estimates = Twin(load_scene(), EXACT).take(block_of(samples_in(SESSION, streams, 15.0), 4)).estimates
        times = (estimates.stamps - estimates.stamps[0]) * 1e-9 + truth.times[0]
        off = (estimates.tip[:, :2] - truth.at(times, truth.position))[times > QUIET]
        normalised = off / np.sqrt(estimates.tip_covariance[times > QUIET][:, [0, 3]])
        found.append((np.sqrt(np.mean(off**2)), np.sqrt(np.mean(normalised**2))))
    (alone, _), (with_imu, normalised) = found
    assert with_imu < 1.05 * alone
    assert normalised < 1.6


def test_tip_and_load_are_estimated_with_true_deviations(kind, tmp_path):
    """Prediction, estimate from all sensors with its deviation, and the pump within 15 %, its rate within 2 %."""
    found, truth = replay(SESSIONS[kind], None, tmp_path, EXACT), load_truth(SESSIONS[kind])
    summary, estimates = found.summary, found.recording.whole.estimates
    assert summary["samples"] == 8000 and summary["dropped"] == 0 and summary["alarms"] == []
    assert summary["tip_error_rms_m"] < TIP[kind] and summary["tip_estimate_error_rms_m"] < ESTIMATE[kind]
    assert summary["tip_estimate_acceleration_error_rms_m_s2"] < 0.12
    times = (estimates.stamps - estimates.stamps[0]) * 1e-9 + truth.times[0]
    off = (estimates.tip[:, :2] - truth.at(times, truth.position))[times > QUIET]
    assert 0.4 < np.sqrt(np.mean(off**2 / estimates.tip_covariance[times > QUIET][:, [0, 3]])) < 1.6
    assert summary["tip_load_pulses_N"] == pytest.approx(130.0, rel=0.15)
    assert summary["tip_load_frequency_Hz"] == pytest.approx(0.43, rel=0.02)
