"""The balances of energy and momentum that `simulate --check` prints: closed with the square of the step, with contact too."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle import booms
from published import scenes
from studies.clearance.scenes import treated, with_play
from studies.stops import StopMotion, halt

from boom_twin import load_scene, undeflected
from boom_twin.analysis.energy_balance import energy_balance
from boom_twin.analysis.momentum_balance import Momenta, momentum_balance
from boom_twin.analysis.motions import motion_of
from boom_twin.analysis.simulate import course_of

SCENE = load_scene()


def course(scene, span=1.0):
    move, times = motion_of(scene), np.linspace(0.0, span, 251)
    return course_of(scene, times, move(times)[0], angles=move.angles)


def test_a_flexible_boom_in_motion():
    """A fourth of the gaps at half the step; damping takes what decay takes, far more than the gap."""
    coarse, fine = (energy_balance(course(SCENE), step) for step in (2e-3, 1e-3))
    assert 3.3 < coarse.gap / fine.gap < 4.7
    assert fine.share < 2e-5 and fine.damping > 20.0 * fine.gap and fine.contact == 0.0
    assert fine.work == pytest.approx(fine.change + fine.damping, rel=1e-4)
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
    assert energy.gap < (0.02 * energy.contact if treatment == "contact" else 1e-3 * energy.moved)
    assert momentum.linear_share < 2e-5 and momentum.angular_share < 2e-5


def numerical_damping(frequency, step, rho):
    """Damping ratio that generalised-alpha gives an undamped oscillator of `frequency` (Hz) in steps of `step` (s).

    From the spectral radius R of its amplification matrix over (x, v, p): -ln R over the angle turned. About (omega h)^3.
    """
    am, af, w = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0), (2.0 * math.pi * frequency * step) ** 2
    gamma = 0.5 + af - am
    beta = 0.25 * (gamma + 0.5) ** 2
    after = np.array([[1.0, 0.0, -beta], [0.0, 1.0, -gamma], [(1.0 - af) * w, 0.0, 1.0 - am]])  # of x', h v', h^2 p'
    before = np.array([[1.0, 1.0, 0.5 - beta], [0.0, 1.0, 1.0 - gamma], [-af * w, 0.0, -am]])
    own = np.linalg.eigvals(np.linalg.solve(after, before))
    principal = own[int(np.argmax(np.abs(own.imag)))]
    return float(-math.log(abs(principal)) / abs(np.angle(principal)))


def test_an_undamped_boom_loses_what_generalised_alpha_takes():
    """A rigid section swinging on its oil spring for 300 periods: what is lost is what the amplification matrix says."""
    rod = scenes.rigid(1.0, 10.0, 0.5, 10.0 / 12.0) | {"rod_pin": (0.5, 0.0)}
    cylinder, step, rho, span = {"k": 5e5, "closed_length": 9.0, "max_stroke": 2.0}, 1e-3, 0.6, 10.0
    scene = scenes.scene([rod], [scenes.crank(cylinder)], gravity=(0.0, 0.0))
    lever = 0.5 * 10.0 / math.hypot(0.5, 10.0)  # of the cylinder from (0, 10) to (0.5, 0) about the pivot
    frequency = math.sqrt(5e5 * lever**2 / (10.0 / 3.0)) / (2.0 * math.pi)
    first = np.array([math.hypot(0.5, 10.0) - 9.0])
    start = undeflected(scene, first, np.array([0.05]), np.zeros(1))
    swinging = course_of(scene, np.linspace(0.0, span, 3), np.tile(first, (3, 1)), rho=rho, start=start)
    found, energy = energy_balance(swinging, step), 0.5 * 10.0 / 3.0 * 0.05**2
    damping = numerical_damping(frequency, step, rho)
    expected = energy * -math.expm1(-4.0 * math.pi * damping * frequency * span)
    assert expected > 5e-3 * energy
    assert found.left == pytest.approx(expected, rel=0.05)
    assert found.share == pytest.approx(found.left / energy, rel=0.05)


def test_the_base_bears_the_weight_of_a_boom_at_rest():
    """With every kind of joint and part, and on a base that is inclined: forces and moment of the base balance all weight."""
    scene = booms.random_boom(31)
    own = course(scene)
    momenta, g = Momenta(own.plan, own.plan.work()), np.hypot(*own.plan.tables.gravity)
    weight = np.sum(own.plan.weights**2 / np.maximum(own.plan.masses, 1e-300)) / g  # each mass stands as x and as y
    assert np.abs(momenta.forces(own.start)[:2]).max() < 1e-9 * weight
    assert abs(momenta.forces(own.start)[2]) < 1e-9 * weight * scene.reach
    assert np.all(momenta.momentum(own.start) == 0.0)
