"""A session that was recorded with ideal pins, replayed with worn ones: pins rest in their bushes."""

from __future__ import annotations

import numpy as np
import pytest
from drive_twin import ARCH_DRIVES
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins

from boom_twin import replay


@pytest.mark.slow
def test_no_sample_is_lost_and_every_pin_is_told(tmp_path):
    """Pins stay within their clearance, and follow the posture along the bush."""
    found = replay(ARCH_DRIVES, with_pins(booms.document(), RODS), tmp_path)
    assert found.summary["samples"] == 12000 and found.summary["dropped"] == 0
    assert "model" not in found.summary["events"]
    pins = found.recording.whole.predictions.clearances
    assert pins.shape == (12000, 4, 4)
    assert np.hypot(pins[:, :, 0], pins[:, :, 1]).max() < 1.5e-4
    assert np.ptp(np.arctan2(pins[:, 3, 1], pins[:, 3, 0])) > 0.2
