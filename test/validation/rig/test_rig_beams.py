"""Beams that are exact at their nodes: few elements do what many do."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("exudyn")

from boom_twin import Scene, load_scene
from boom_twin.scene.kinematics import strokes_of_posture
from boom_twin.validation.rig import at_rest
from boom_twin.validation.rig.exudyn.probes import read


def found(scene, strokes, elements, nodally_exact):
    """Tip (m), joints (rad) at rest."""
    resting = at_rest(scene, strokes, elements, nodally_exact)
    values = read(resting.boom, resting.probes, at_rest=True)
    return values["tip"][-1], values["joints"][-1]


@pytest.mark.parametrize("elements", [1, 2, 5])
def test_cantilever_under_an_end_load(cantilever, elements):
    """P l^3/3EI, with the beam's own weight in its head."""
    weight, bending = 100.0 * 9.81, 2.06e11 * 1e-5
    cantilever["sections"][0] |= {"rho_A": 1e-6}
    scene = Scene.model_validate(cantilever | {"tip": {"payload": 100.0}})
    strokes = strokes_of_posture(scene, "flat")
    (_, y), _ = found(scene, strokes, elements, True)
    assert -y == pytest.approx(weight * 4.0**3 / (3.0 * bending), rel=2e-4)
    (_, y), _ = found(scene, strokes, elements, False)
    assert -y == pytest.approx(weight * 4.0**3 / (3.0 * bending) * (1.0 - 0.25 / elements**2), rel=2e-4)


@pytest.mark.parametrize("posture", ["arch", "horizontal"])
def test_six_elements_of_the_default_boom(posture):
    scene = load_scene()
    strokes = strokes_of_posture(scene, posture)
    tip, joints = found(scene, strokes, 32, True)
    few_tip, few_joints = found(scene, strokes, 6, True)
    assert np.linalg.norm(few_tip - tip) < 1.5e-4
    assert few_joints == pytest.approx(joints, abs=1e-5)
