"""What a replay counts as time when a clock was set within the session."""

from __future__ import annotations

import numpy as np
import pytest
from drive_twin import drive_twin

from boom_twin import Sample, Stream, load_scene
from boom_twin.offline.ground_truth import TipTruth
from boom_twin.offline.recording import Recording
from boom_twin.scene.kinematics import strokes_of_posture

MS = 1_000_000


@pytest.mark.parametrize("shift", [-7_200_000, 7_200_000])
def test_duration_and_errors_go_by_the_time_that_passed(shift):
    scene = load_scene()
    still, twin, recording = strokes_of_posture(scene, "arch"), drive_twin(scene), Recording(4)
    for k in range(200):
        stamp = 1_700_000_000_000 * MS + (5 * k + (shift if k >= 120 else 0)) * MS
        recording.add(twin.update(Sample(Stream.STROKES, stamp, still)))
    predictions = recording.predictions
    assert len(predictions.stamps) == 200 and len(recording.clock_sets) == 1
    assert recording.duration == pytest.approx(198 * 0.005)  # the one interval in which the clock was set is not known
    assert recording.by_first_clock == slice(120)
    times = np.arange(120) * 0.005
    position = predictions.tip_position[:120]
    errors = TipTruth(times, position, np.zeros((120, 2)), None).errors(predictions, recording.by_first_clock)
    assert errors["tip_error_rms_m"] == pytest.approx(0.0, abs=1e-9)
