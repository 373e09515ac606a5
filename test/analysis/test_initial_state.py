"""Simulations that go on where another ended, and a boom that is let go from the undeflected posture."""

from __future__ import annotations

import numpy as np
import pytest
from default_boom import motion_of, posture_angles, strokes_of_posture
from published import scenes
from studies.papers.let_go import undeflected

from boom_twin import UsageError, load_scene, simulate

SCENE = load_scene()
QUIET = {"estimate_errors": False}


def test_a_boom_let_go_falls_freely_first_and_swings_about_its_rest():
    """The papers' first move down under gravity: no force holds the undeflected boom, so all of it falls with g."""
    angles, times = posture_angles(SCENE, "horizontal"), np.linspace(0.0, 6.0, 1201)
    strokes = np.tile(strokes_of_posture(SCENE, "horizontal"), (len(times), 1))
    found = simulate(SCENE, times, strokes, 1e-3, angles, start=undeflected(SCENE, strokes[0], angles), **QUIET)
    rest = simulate(SCENE, times[:1], strokes[:1], 1e-3, angles, **QUIET)
    assert found.tip_acceleration[0, :2] == pytest.approx([0.0, -9.81], abs=1e-2)
    assert np.abs(found.cylinder_forces[0]).max() < 5.0
    assert found.tip[0, :2] == pytest.approx([13.46, 0.0], abs=1e-12)
    sag = rest.tip[0, 1]
    assert found.tip[:, 1].min() < 1.7 * sag
    assert np.mean(found.tip[:, 1]) == pytest.approx(sag, rel=0.1)


def test_a_run_goes_on_where_another_ended():
    move, cut = motion_of(SCENE), 200
    times = np.linspace(0.0, 2.0, 401)
    strokes, _ = move(times)
    whole = simulate(SCENE, times, strokes, 1e-3, move.angles, **QUIET)
    head = simulate(SCENE, times[: cut + 1], strokes[: cut + 1], 1e-3, move.angles, **QUIET)
    tail = simulate(SCENE, times[cut:], strokes[cut:], 1e-3, start=head.end, **QUIET)
    assert np.abs(tail.tip - whole.tip[cut:]).max() < 1e-6
    assert np.abs(tail.tip_acceleration - whole.tip_acceleration[cut:]).max() < 2e-3
    assert np.abs(tail.cylinder_forces - whole.cylinder_forces[cut:]).max() < 2.0


def test_the_end_of_another_boom_is_refused():
    rod = scenes.scene([scenes.rigid(1.0, 1.0, 0.5, 1.0 / 12.0)], [scenes.crank(scenes.FREE)])
    end = simulate(SCENE, np.zeros(1), strokes_of_posture(SCENE, "arch")[None], **QUIET).end
    with pytest.raises(UsageError, match="start: this state is of another boom"):
        simulate(rod, np.zeros(1), np.array([[8.9]]), start=end, **QUIET)
