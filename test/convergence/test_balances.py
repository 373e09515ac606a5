"""Balances of energy and momentum along a motion: closed with the square of the step, with contact too."""

from __future__ import annotations

import numpy as np
import pytest
from convergence import motions
from convergence.balances import Momenta, energy_balance, momentum_balance
from default_boom import motion_of, posture_angles, strokes_of_posture
from oracle import booms
from studies.clearance.scenes import treated, with_play
from studies.stops import StopMotion, halt

from boom_twin import load_scene
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
    spec = booms.undamped()
    del spec["joints"][2]["cylinder"]["k"]
    return booms.scene_of(spec), "arch", (0.03, -0.02, 0.03, 0.02)


def mixed():
    """A random boom of four sections with payload, fill, rigid and massless parts."""
    return booms.random_boom(8), "test", (0.02, -0.02, 0.02, -0.02)


def on_an_elastic_base():
    """The default scene on a hinge that takes energy too."""
    return booms.on_elastic_base(booms.scene_of(booms.document()), 5.0e6, 5.0e4), "arch", (0.03, -0.02, 0.03, 0.02)


@pytest.mark.parametrize("boom", [damped, undamped, mixed, on_an_elastic_base])
def test_energy_closes_with_the_square_of_the_step(boom):
    found = [balance(*boom(), step) for step in STEPS]
    gaps = np.array([own.gap for own in found])
    assert np.polyfit(np.log(STEPS), np.log(gaps), 1)[0] > 1.8
    assert gaps[-1] < 1e-3 * abs(found[-1].work)
    assert (found[-1].damping > 10.0 * gaps[-1]) == (boom is not undamped)


SCENE = load_scene()


def course(scene, span=1.0):
    move, times = motion_of(scene), np.linspace(0.0, span, 251)
    return course_of(scene, times, move(times)[0], angles=move.angles)


def test_a_flexible_boom_in_motion():
    """A fourth of the gaps at half the step, as of energy."""
    coarse, fine = (momentum_balance(course(SCENE), step) for step in (2e-3, 1e-3))
    assert 3.3 < coarse.linear_gap / fine.linear_gap < 4.7 and 3.3 < coarse.angular_gap / fine.angular_gap < 4.7
    assert 0.0 < fine.linear_share < 1e-6 and 0.0 < fine.angular_share < 1e-6


@pytest.mark.parametrize("treatment", ["contact", "spring-damper"])
def test_worn_pins_in_a_stop(treatment):
    """What impacts take is found by its own sum, and is far more than what is left open; contact acts on both bodies alike."""
    scene = treated(with_play(SCENE), treatment)
    own = halt(scene, "arch", 0.05)
    stop, times = StopMotion(own.angles, own.first, own.speed, 0.02, 0.1, 0.15), np.linspace(0.0, 0.3, 61)
    stopped = course_of(scene, times, stop(times)[0], angles=stop.angles)
    energy, momentum = energy_balance(stopped, 1e-3), momentum_balance(stopped, 1e-3)
    assert energy.contact > 0.02
    assert energy.gap < 0.02 * energy.contact if treatment == "contact" else energy.share < 1e-3
    assert momentum.linear_share < 2e-5 and momentum.angular_share < 2e-5


def test_the_base_bears_the_weight_of_a_boom_at_rest():
    """With every kind of joint and part, and on a base that is inclined: forces and moment of the base balance all weight."""
    scene = booms.random_boom(31)
    own = course(scene)
    momenta, g = Momenta(own.plan, own.plan.work()), np.hypot(*own.plan.tables.gravity)
    weight = np.sum(own.plan.weights**2 / np.maximum(own.plan.masses, 1e-300)) / g  # each mass stands as x and as y
    assert np.abs(momenta.forces(own.start, np.zeros(2))[:2]).max() < 1e-9 * weight
    assert abs(momenta.forces(own.start, np.zeros(2))[2]) < 1e-9 * weight * scene.reach
    assert np.all(momenta.momentum(own.start) == 0.0)
