"""Work of the drives = change of energy + dissipation; the balance closes with the square of the step."""

from __future__ import annotations

import numpy as np
import pytest
from convergence import motions
from oracle import booms, segments

from boom_twin.analysis.drive import PASSES, STEP_TOLERANCE
from boom_twin.analysis.energy_balance import Energies
from boom_twin.analysis.equilibrium import settle
from boom_twin.compiler.compile import compile_scene
from boom_twin.kernels.integrators import GENERALISED_ALPHA, prepare
from boom_twin.kernels.transfer.time_step import LONGEST_INCREMENT, advance

STEPS = (4e-3, 2e-3, 1e-3, 5e-4)


def balance(scene, posture, travel, step, rho=0.8, duration=0.8):
    """Largest gap of the balance (J) at any step, and the largest work (J) and dissipation (J)."""
    plan = compile_scene(scene)
    state, work = plan.state(), plan.work()
    angles = np.diff(np.radians(scene.postures[posture]), prepend=0.0)
    drive = motions.smooth_drive(segments.Segments(scene, 0).lengths(angles), travel, 0.5)
    settle(plan, state, work, drive(0.0)[0] - plan.closed_lengths, angles)
    energies, scheme = Energies(plan), prepare(GENERALISED_ALPHA, rho, step, work.weights)
    start = energies.total(state)
    powers, gaps, done, lost = [(0.0, 0.0)], [], 0.0, 0.0
    for k in range(1, round(duration / step) + 1):
        length, rate, _ = drive(k * step)
        status, _, _ = advance(
            plan.tables, state, work, scheme, length, rate, STEP_TOLERANCE, PASSES, LONGEST_INCREMENT, None, False
        )
        assert status == 0
        powers.append((energies.drive_power(state), energies.damping_power(state)))
        done += 0.5 * step * (powers[-1][0] + powers[-2][0])
        lost += 0.5 * step * (powers[-1][1] + powers[-2][1])
        gaps.append(energies.total(state) - start - done + lost)
    return np.abs(gaps).max(), abs(done), lost


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


@pytest.mark.parametrize("boom", [damped, undamped, mixed])
def test_balance_closes_with_the_square_of_the_step(boom):
    table = np.array([balance(*boom(), step) for step in STEPS])
    gaps, done, lost = table.T
    slope = np.polyfit(np.log(STEPS), np.log(gaps), 1)[0]
    assert slope > 1.8
    assert gaps[-1] < 1e-3 * done[-1]
    assert (lost[-1] > 10.0 * gaps[-1]) == (boom is not undamped)
