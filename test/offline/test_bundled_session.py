"""The bundled sessions and their predecessors of drives, all synthetic, replayed as recorded: what is promised of them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from default_boom import EXACT
from drive_twin import ARCH_DRIVES, PUMP_DRIVES
from offline.by_the_node import assert_same_bytes
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins
from recordings import load_truth, scan
from ros_messages import load_topics
from session_readings import samples_in

from boom_twin import Stream, Twin, load_scene, replay
from boom_twin.cli.replay import as_text
from boom_twin.twin.blocks import block_of
from boom_twin.types import StrokeReading

BAGS = Path(__file__).parents[2] / "bags"
SESSIONS = {"length": BAGS / "arch_session", "drive": ARCH_DRIVES}
NEARER = {"length": 1.0, "drive": 0.8}  # most that the error of the estimate is of that of the prediction
SENSOR = 1.745e-4  # rad, a joint encoder's own noise


@pytest.fixture(scope="module", params=list(SESSIONS))
def session(request):
    return SESSIONS[request.param]


@pytest.fixture(scope="module")
def first(session, tmp_path_factory):
    out = tmp_path_factory.mktemp("replay")
    return replay(session, load_scene(), out), out


def test_tip_follows_the_truth(first):
    summary = first[0].summary
    assert summary["samples"] == 12000 and summary["dropped"] == 0 and summary["alarms"] == []
    assert summary["tip_error_rms_m"] < 3e-3
    assert summary["tip_acceleration_error_rms_m_s2"] < 0.25


def test_the_estimate_is_nearer_to_the_truth_than_the_prediction(first):
    summary = first[0].summary
    assert summary["tip_estimate_error_rms_m"] < NEARER[summary["strokes"]] * summary["tip_error_rms_m"]
    assert summary["tip_estimate_acceleration_error_rms_m_s2"] < 0.6 * summary["tip_acceleration_error_rms_m_s2"]
    assert (
        summary["tip_load"].startswith("none above ") and 0.0 < summary["tip_load_rms_N"] < summary["tip_load_sigma_N"] < 25.0
    )
    lines = [line for line in as_text(summary) if line.startswith(("tip error", "acceleration error", "load at the tip"))]
    assert [line.count("of the estimate") for line in lines] == [1, 1, 0] and lines[2].endswith(summary["tip_load"])


def test_residuals_are_what_is_expected(first):
    summary, recording = first[0].summary, first[0].recording
    spread = np.array(summary["joint_residual_normalised_std"])
    is_length = summary["strokes"] == "length"  # drives tell nothing of loads: what is stated holds those that may come
    assert np.all((spread > (0.85 if is_length else 0.0)) & (spread < 1.15))
    assert np.all(np.abs(summary["joint_residual_normalised_mean"]) < 0.3)
    sigmas = recording.whole.residuals_of(Stream.ANGLES).sigmas
    assert np.all(sigmas >= SENSOR) and (np.all(sigmas <= 2 * SENSOR) or not is_length)


def test_summary_is_on_disk_and_complete(first):
    summary = json.loads((first[1] / "summary.json").read_text())
    assert summary == first[0].summary
    wanted = {"samples", "duration_s", "wall_s", "realtime_factor", "dropped", "joint_residual_rms_rad"}
    wanted |= {"tip_acceleration_max_m_s2", "output_sha256", "alarms"}
    assert wanted <= summary.keys()
    assert summary["realtime_factor"] == pytest.approx(summary["duration_s"] / summary["wall_s"])


def test_the_result_bag_holds_what_the_three_calls_give(session, first):
    """Two seconds of it."""
    assert_same_bytes(session, first[1], load_topics(), StrokeReading(first[0].summary["strokes"]), 2400)


@pytest.mark.slow
def test_no_sample_is_lost_and_every_pin_is_told_if_pins_are_worn(tmp_path):
    """Recorded with ideal pins, replayed with worn ones: they stay within their clearance, and follow the posture."""
    found = replay(ARCH_DRIVES, with_pins(booms.document(), RODS), tmp_path)
    assert found.summary["samples"] == 12000 and found.summary["dropped"] == 0
    assert "model" not in found.summary["events"]
    pins = found.recording.whole.predictions.clearances
    assert pins.shape == (12000, 4, 4)
    assert np.hypot(pins[:, :, 0], pins[:, :, 1]).max() < 1.5e-4
    assert np.ptp(np.arctan2(pins[:, 3, 1], pins[:, 3, 0])) > 0.2


PUMP = {"lengths": BAGS / "pump_session", "drives": PUMP_DRIVES}
TIP, ESTIMATE = {"lengths": 1.5e-3, "drives": 0.05}, {"lengths": 0.8e-3, "drives": 1e-3}  # m, most that the errors may be
QUIET = 5.0  # s, before the pump begins


@pytest.fixture(scope="module", params=PUMP)
def kind(request):
    return request.param


def test_the_truth_of_the_pump_session_has_the_load(kind):
    assert sum(file.stat().st_size for file in PUMP[kind].iterdir()) < 4e6
    notes = scan(PUMP[kind]).notes
    assert "synthetic" in notes["origin"] and notes["loads"].endswith("pump:0.43:130:0.1@5, wind:15:5")
    truth = np.genfromtxt(PUMP[kind] / "truth.csv.gz", delimiter=",", names=True)
    pump, wind, times = truth["tip_load_y_N"], truth["tip_load_x_N"], truth["t_s"]
    assert not pump[times < QUIET].any() and pump.max() == pytest.approx(130.0, abs=0.1)
    begun = times > QUIET
    power = np.abs(np.fft.rfft(pump[begun] - pump[begun].mean())) ** 2
    assert np.fft.rfftfreq(begun.sum(), 0.005)[power.argmax()] == pytest.approx(0.43, abs=0.02)
    assert 7.0 < wind[begun].std() < 25.0


@pytest.mark.parametrize("more", [(Stream.IMU,), (Stream.ANGLES, Stream.IMU)])
def test_an_imu_makes_no_estimate_worse(more):
    """The pump begins at 5 s. What the IMU adds must not be taken for valves that open."""
    truth, found = load_truth(PUMP["lengths"]), []
    for streams in ((Stream.STROKES,), (Stream.STROKES, *more)):
        estimates = Twin(load_scene(), EXACT).take(block_of(samples_in(PUMP["lengths"], streams, 15.0), 4)).estimates
        times = (estimates.stamps - estimates.stamps[0]) * 1e-9 + truth.times[0]
        off = (estimates.tip[:, :2] - truth.at(times, truth.position))[times > QUIET]
        normalised = off / np.sqrt(estimates.tip_covariance[times > QUIET][:, [0, 3]])
        found.append((np.sqrt(np.mean(off**2)), np.sqrt(np.mean(normalised**2))))
    (alone, _), (with_imu, normalised) = found
    assert with_imu < 1.05 * alone
    assert normalised < 1.6


def test_tip_and_load_are_estimated_with_true_deviations(kind, tmp_path):
    """Prediction, estimate from all sensors with its deviation, and the pump within 15 %, its rate within 2 %."""
    found, truth = replay(PUMP[kind], None, tmp_path, EXACT), load_truth(PUMP[kind])
    summary, estimates = found.summary, found.recording.whole.estimates
    assert summary["samples"] == 8000 and summary["dropped"] == 0 and summary["alarms"] == []
    assert summary["tip_error_rms_m"] < TIP[kind] and summary["tip_estimate_error_rms_m"] < ESTIMATE[kind]
    assert summary["tip_estimate_acceleration_error_rms_m_s2"] < 0.12
    times = (estimates.stamps - estimates.stamps[0]) * 1e-9 + truth.times[0]
    off = (estimates.tip[:, :2] - truth.at(times, truth.position))[times > QUIET]
    assert 0.4 < np.sqrt(np.mean(off**2 / estimates.tip_covariance[times > QUIET][:, [0, 3]])) < 1.6
    assert summary["tip_load_pulses_N"] == pytest.approx(130.0, rel=0.15)
    assert summary["tip_load_frequency_Hz"] == pytest.approx(0.43, rel=0.02)
