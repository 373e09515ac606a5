"""The study of the papers: low speed."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import motion_of
from studies.papers import low_speed

from boom_twin import load_scene

SCENE = load_scene()


def test_leaving_velocity_terms_out_errs_with_the_square_of_the_speed() -> None:
    speeds = low_speed.error_by_speed(SCENE, motion_of(SCENE), (6.0, 3.0), 5e-3)
    slopes = np.log(speeds[1, 1:] / speeds[0, 1:]) / np.log(speeds[1, 0] / speeds[0, 0])
    assert slopes == pytest.approx([2.0, 2.0], abs=0.15)
    assert 5e-4 < speeds[1, 1] < 2e-3  # m
