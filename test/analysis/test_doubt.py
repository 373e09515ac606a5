"""Doubts that a motion raises about its own step: coarse, ringing, and none where neither is the case."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin import load_scene
from boom_twin.analysis.methods import Method, integrate_with
from boom_twin.validation.study.scene_changes import cylinders
from boom_twin.validation.study.stability.setups import dead_stop, smooth

SCENE = load_scene()


@pytest.mark.parametrize("step", [2e-2, 4e-2])
def test_the_estimate_is_near_the_error(step):
    """The doubt names a share of the tip's path; the true one is within a factor of three."""
    own = smooth(SCENE, None, 1.0, 0.4, 2.0, step)
    coarse = integrate_with(SCENE, own.drive, 2.0, step, 1, angles=own.angles)
    fine = integrate_with(SCENE, own.drive, 2.0, step / 20, 20, angles=own.angles)
    path = np.linalg.norm(fine.tip - fine.tip[0], axis=1).max()
    error = np.linalg.norm(coarse.tip - fine.tip, axis=1).max() / path
    assert coarse.doubt.startswith("the step is coarse")
    said = float(coarse.doubt.split("about ")[1].split("%")[0]) / 100
    assert error / 3 < said < 3 * error


def test_ringing_is_doubted():
    stop = dead_stop(cylinders(SCENE, None))
    found = integrate_with(stop.scene, stop.drive, 1.0, stop.step, 1, Method(parameter=1.0), angles=stop.angles)
    calm = integrate_with(stop.scene, stop.drive, 1.0, stop.step, 1, angles=stop.angles)
    assert "change sign from step to step" in found.doubt and calm.doubt == ""
