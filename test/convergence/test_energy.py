"""Work of the drives = change of energy + dissipation; the balance closes with the square of the step."""

from __future__ import annotations

import numpy as np
import pytest
from convergence import motions
from convergence.balances import energy_balance
from default_boom import posture_angles, strokes_of_posture
from oracle import booms

from boom_twin.analysis.simulate import course_of

STEPS = (4e-3, 2e-3, 1e-3, 5e-4)


def balance(scene, posture, travel, step):
    """Balance of energy of a smooth move with steps of `step` s."""
    angles, times = posture_angles(scene, posture), np.linspace(0.0, 0.8, 201)
    drive = motions.smooth_drive(strokes_of_posture(scene, posture), travel, 0.5)
    return energy_balance(course_of(scene, times, drive(times[:, None])[0], angles=angles), step)


def damped():
    """The default scene as it stands."""
    return booms.scene_of(booms.document()), "arch", (0.03, -0.02, 0.03, 0.02)


def undamped():
    """No damping anywhere, one cylinder incompressible: only the drives change the energy."""
    spec = booms.document()
    spec["sections"] = [{k: v for k, v in section.items() if k != "beta"} for section in spec["sections"]]
    for joint in spec["joints"]:
        del joint["cylinder"]["d"]
    del spec["joints"][2]["cylinder"]["k"]
    return booms.scene_of(spec), "arch", (0.03, -0.02, 0.03, 0.02)


def mixed():
    """A random boom of four sections with payload, fill, rigid and massless parts."""
    return booms.random_boom(8), "test", (0.02, -0.02, 0.02, -0.02)


def on_an_elastic_base():
    """The default scene on a hinge that takes energy too."""
    return booms.on_elastic_base(booms.scene_of(booms.document()), 5.0e6, 5.0e4), "arch", (0.03, -0.02, 0.03, 0.02)


@pytest.mark.parametrize("boom", [damped, undamped, mixed, on_an_elastic_base])
def test_balance_closes_with_the_square_of_the_step(boom):
    found = [balance(*boom(), step) for step in STEPS]
    gaps = np.array([own.gap for own in found])
    assert np.polyfit(np.log(STEPS), np.log(gaps), 1)[0] > 1.8
    assert gaps[-1] < 1e-3 * abs(found[-1].work)
    assert (found[-1].damping > 10.0 * gaps[-1]) == (boom is not undamped)
