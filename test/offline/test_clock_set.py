"""What a replay counts as time when a clock was set within the session."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import strokes_of_posture
from drive_twin import drive_twin

from boom_twin import Sample, Stream, load_scene
from boom_twin.offline.ground_truth import TipErrors, TipTruth
from boom_twin.offline.recording import Recording
from boom_twin.twin.blocks import block_of

MS = 1_000_000


def test_duration_and_errors_go_by_the_time_that_passed():
    """The truth, by the first clock, is at rest until that was set, and elsewhere then."""
    scene = load_scene()
    still, twin = strokes_of_posture(scene, "arch"), drive_twin(scene)
    stamps = [1_700_000_000_000 * MS + (5 * k + (-7_200_000 if k >= 120 else 0)) * MS for k in range(200)]
    samples = block_of([Sample(Stream.STROKES, stamp, still) for stamp in stamps], 4)
    rows = twin.take(samples)
    position = np.tile(rows.predictions.tip_position[0], (200, 1)) + (np.arange(200) >= 120)[:, np.newaxis]
    errors = TipErrors(TipTruth(np.arange(200) * 0.005, position, np.zeros((200, 2))))
    recording = Recording(4, errors=errors)
    recording.add(rows, samples)
    recording.close()
    assert len(recording.whole.predictions.stamps) == 180 and len(recording.clock_sets) == 1
    assert recording.duration == pytest.approx(178 * 0.005)  # without the time until the new stamps are confirmed
    assert errors.rms["tip_error_rms_m"] == pytest.approx(0.0, abs=1e-6)
