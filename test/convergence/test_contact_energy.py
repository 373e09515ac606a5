"""In a closed system contact never gives energy: a boom shaken by its drives, which then stand still."""

from __future__ import annotations

import numpy as np
import pytest
from compiled import compile_scene, settle, stepped
from convergence.balances import Energies
from default_boom import posture_angles, strokes_of_posture
from oracle import booms
from oracle.clearance.scenes import RODS, with_pins

from boom_twin.kernels.elements.pin_contact import LOST

LONG = {1e-3: 2000, 1e-4: 5000, 1e-5: 5000}
PULSE, DURATION = np.array([0.03, -0.02, 0.03, 0.02]), 0.4  # m, s: a jerk of all four cylinders


def booms_with(law, restitution, **contact):
    """The default boom on worn rod pins, without any damping of its own."""
    return with_pins(booms.undamped(), RODS, law=law, restitution=restitution, **contact)


class Closed:
    """A boom after its drives have shaken it; its energy counts from where it will rest."""

    def __init__(self, scene, step):
        self.plan = compile_scene(scene)
        self.state, self.work, self.step = self.plan.state(), self.plan.work(), step
        first, angles = strokes_of_posture(scene, "arch"), posture_angles(scene, "arch")
        self.drive, self.rest = self.plan.closed_lengths + first + PULSE, 0.0
        settle(self.plan, self.state, self.work, first + PULSE, angles)
        self.rest = self.energy()
        settle(self.plan, self.state, self.work, first, angles)
        x = np.arange(1, round(DURATION / step) + 1)[:, None] * step / DURATION
        drives = self.plan.closed_lengths + first + PULSE * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        self._run(drives, PULSE * 30.0 * x**2 * (1.0 - x) ** 2 / DURATION)
        self.first = self.energy()

    def energy(self):
        """J above rest."""
        return Energies(self.plan).total(self.state) - self.rest

    def watch(self, steps, every):
        """Largest rise above the first energy, energy at the end (both over the first), contacts lost."""
        still, worst = np.zeros((every, self.plan.joints)), 0.0
        drives = np.tile(self.drive, (every, 1))
        for _ in range(steps // every):
            self._run(drives, still)
            worst = max(worst, self.energy() - self.first)
        return worst / self.first, self.energy() / self.first, int(self.state.contacts[:, LOST].sum())

    def _run(self, drives, rates):
        stepped(self.plan, self.state, self.work, self.step, len(drives), drives, rates)


@pytest.mark.parametrize("step", LONG)
@pytest.mark.parametrize(("law", "restitution"), [("hertz", 1.0), ("lankarani-nikravesh", 0.9)])
def test_energy_never_exceeds_the_first(law, restitution, step):
    closed = Closed(booms_with(law, restitution), step)
    rise, left, lost = closed.watch(LONG[step], 10)
    assert rise < 1e-3
    assert left < 1.0 + 1e-6
    assert lost > 0 or step < 1e-4


def test_elastic_contact_loses_little_where_it_is_resolved():
    _, left, _ = Closed(booms_with("hertz", 1.0), 1e-4).watch(3000, 10)
    assert 0.999 < left < 1.0 + 1e-6


def test_friction_only_takes():
    _, without, _ = Closed(booms_with("lankarani-nikravesh", 0.9), 1e-3).watch(500, 10)
    rise, left, _ = Closed(booms_with("lankarani-nikravesh", 0.9, friction=0.1), 1e-3).watch(500, 10)
    assert rise < 1e-3 and left < without
    assert np.isfinite(left)
