"""The balance of momentum that `simulate --check` prints: closed with the square of the step, with clearance too."""

from __future__ import annotations

import numpy as np
import pytest
from oracle import booms
from studies.clearance.scenes import treated, with_play
from studies.stops import StopMotion, halt

from boom_twin import load_scene
from boom_twin.analysis.momentum_balance import Momenta, momentum_balance
from boom_twin.analysis.motions import motion_of
from boom_twin.analysis.simulate import course_of

SCENE = load_scene()


def course(scene, span=1.0):
    move, times = motion_of(scene), np.linspace(0.0, span, 251)
    return course_of(scene, times, move(times)[0], angles=move.angles)


def test_a_flexible_boom_in_motion():
    """A fourth of the gap at half the step, of momentum and of its moment."""
    coarse, fine = (momentum_balance(course(SCENE), step) for step in (2e-3, 1e-3))
    assert 3.3 < coarse.linear_gap / fine.linear_gap < 4.7
    assert 3.3 < coarse.angular_gap / fine.angular_gap < 4.7
    assert 0.0 < fine.linear_share < 1e-6
    assert 0.0 < fine.angular_share < 1e-6


def test_the_base_bears_the_weight_of_a_boom_at_rest():
    """With every kind of joint and part, and on a base that is inclined: forces and moment of the base balance all weight."""
    scene = booms.random_boom(31)
    own = course(scene)
    momenta = Momenta(own.plan, own.plan.work())
    weight = np.hypot(*own.plan.tables.gravity) * scene_mass(own.plan)
    assert np.abs(momenta.forces(own.start)[:2]).max() < 1e-9 * weight
    assert abs(momenta.forces(own.start)[2]) < 1e-9 * weight * scene.reach
    assert np.all(momenta.momentum(own.start) == 0.0)


def scene_mass(plan):
    """kg, of all mass points: each stands twice among the histories, x and y, with its weight."""
    return np.hypot(*plan.tables.gravity) ** -2 * np.sum(plan.weights**2 / np.maximum(plan.masses, 1e-300))


@pytest.mark.parametrize("treatment", ["contact", "spring-damper"])
def test_worn_pins_in_a_stop(treatment):
    """Contact acts on both bodies alike: what is left is the sum's over impacts."""
    scene = treated(with_play(SCENE), treatment)
    own = halt(scene, "arch", 0.05)
    stop, times = StopMotion(own.angles, own.first, own.speed, 0.02, 0.1, 0.15), np.linspace(0.0, 0.3, 61)
    found = momentum_balance(course_of(scene, times, stop(times)[0], angles=stop.angles), 1e-3)
    assert found.linear_share < 2e-5
    assert found.angular_share < 2e-5


def test_a_force_without_its_opposite_shows(monkeypatch):
    """One newton at the barrel pin that nothing bears: the gap grows by its impulse."""
    forces = Momenta.forces
    monkeypatch.setattr(Momenta, "forces", lambda self, state: forces(self, state) + np.array([0.0, 1.0, 0.0]))
    assert momentum_balance(course(SCENE, 0.5), 2e-3).linear_gap == pytest.approx(0.5, rel=0.1)
