"""Energy of closed booms with contact over many steps, for every step size: ``python test/bench/contact_energy.py [STEPS]``.

The rig's boom, elastic, on four worn rod pins, makes a twentieth of the steps: it takes as much longer.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from oracle import booms
from oracle.clearance import rigid
from oracle.clearance.scenes import RODS, with_pins

from boom_twin.analysis.drive import PASSES, STEP_TOLERANCE
from boom_twin.analysis.energy_balance import Energies
from boom_twin.analysis.equilibrium import settle
from boom_twin.analysis.simulate import RHO
from boom_twin.compiler.compile import compile_scene
from boom_twin.compiler.plan import width_of
from boom_twin.kernels.elements.pin_contact import LOST
from boom_twin.kernels.integrators import GENERALISED_ALPHA
from boom_twin.kernels.transfer.time_step import run
from boom_twin.scene.kinematics import posture_angles, strokes_of_posture

PULSE, DURATION = np.array([0.03, -0.02, 0.03, 0.02]), 0.4  # m, s: a jerk of all four cylinders
LEVER_PULSE, LEVER_DURATION = np.array([0.05]), 0.1
STEPS = (1e-3, 3e-4, 1e-4, 1e-5)
LAWS = (("hertz", 1.0, False), ("lankarani-nikravesh", 0.9, False), ("flores", 0.5, False), ("lankarani-nikravesh", 0.9, True))


def booms_with(law, restitution, damped=False, **contact):
    """The default boom on worn rod pins, with damping of its own or without any."""
    spec = booms.document()
    if not damped:
        for section, joint in zip(spec["sections"], spec["joints"], strict=True):
            section.pop("beta")
            joint["cylinder"].pop("d")
    return with_pins(spec, RODS, law=law, restitution=restitution, **contact)


def lever_with(law, restitution, damped=False):
    """One rigid section on cylinder 1, whose rod pin is worn."""
    spec = rigid.document(1, 0) | {"postures": {"arch": [30.0]}}
    if not damped:
        spec["joints"][0]["cylinder"].pop("d")
    return with_pins(spec, RODS[:1], law=law, restitution=restitution)


class Closed:
    """A boom after its drives have shaken it; its energy counts from where it will rest."""

    def __init__(self, scene, posture, step, pulse=PULSE, duration=DURATION):
        self.plan = compile_scene(scene)
        self.state, self.work, self.step = self.plan.state(), self.plan.work(), step
        first, angles = strokes_of_posture(scene, posture), posture_angles(scene, posture)
        self.drive, self.rest = self.plan.closed_lengths + first + pulse, 0.0
        settle(self.plan, self.state, self.work, first + pulse, angles)
        self.rest = self.energy()
        settle(self.plan, self.state, self.work, first, angles)
        x = np.arange(1, round(duration / step) + 1)[:, None] * step / duration
        drives = self.plan.closed_lengths + first + pulse * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        self._run(drives, pulse * 30.0 * x**2 * (1.0 - x) ** 2 / duration)
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
        out, count = np.zeros((1, width_of(self.plan))), np.array([len(drives)])
        status, *_ = run(
            self.plan.tables, self.state, self.work, np.array([self.step]), count, drives, rates, GENERALISED_ALPHA, RHO,
            STEP_TOLERANCE, PASSES, None, out,
        )  # fmt: skip
        assert status == 0, status


def main(steps):
    """A line a case, and the worst."""
    worst = (-np.inf, "")
    print("energies over the first, which counts from where the boom will rest")
    for law, restitution, damped in LAWS:
        for step in STEPS:
            lever = Closed(lever_with(law, restitution, damped), "arch", step, LEVER_PULSE, LEVER_DURATION)
            boom = Closed(booms_with(law, restitution, damped), "arch", step)
            for kind, closed, count in (("lever", lever, steps), ("boom", boom, steps // 20)):
                begun = time.perf_counter()
                rise, left, lost = closed.watch(count, max(10, count // 5000))
                name = f"{kind}, {law} {restitution:g}{', damped' if damped else ''}, dt {step:g} s"
                spent = time.perf_counter() - begun
                print(f"{name:50s} {count} steps, rise {rise:.1e}, end {left:.4f}, lost {lost}, {spent:.0f} s", flush=True)
                worst = max(worst, (rise, name))
    print(f"worst: {worst[1]}, {worst[0]:.1e}")


if __name__ == "__main__":
    main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000)
