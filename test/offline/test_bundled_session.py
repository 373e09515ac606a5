"""The bundled session and its predecessor of drives, both synthetic, replayed as recorded: what is promised of them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from drive_twin import ARCH_DRIVES
from offline.by_the_node import assert_same_bytes
from ros_messages import load_topics

from boom_twin import Stream, load_scene, replay
from boom_twin.cli.replay import as_text
from boom_twin.types import StrokeReading

SESSIONS = {"length": Path(__file__).parents[2] / "bags" / "arch_session", "drive": ARCH_DRIVES}
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
