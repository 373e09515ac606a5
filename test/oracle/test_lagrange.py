"""The model's motion against Lagrange's equations of the same bodies, solved to 1e-11: second order, small errors."""

from __future__ import annotations

import numpy as np
import pytest
from convergence import motions
from oracle import booms
from reference.segments import equilibrium as segments
from scipy.integrate import solve_ivp


class Lagrange:
    """The finite-segment boom as an ordinary differential equation: Lagrange's equations with multipliers.

        M q'' + J^T (J' q') + dV/dq + dissipation + G^T lambda = 0,     G q'' + q'.(d2g) q' - l_ref'' = 0 ,

    solved for q'' and lambda at every call and integrated by an explicit Runge-Kutta method of order 8. With fineness 0 it is a
    multibody system of rigid bodies. No discretisation of time or of constraints is shared with the model. `drive`: time ->
    lengths, rates, accelerations, each (n,); `fineness`: see `Segments`.
    """

    def __init__(self, scene, drive, fineness=0):
        self.scene, self.drive, self.model = scene, drive, segments.Segments(scene, fineness)

    def accelerations(self, time, q, v):
        """Accelerations, multipliers of the incompressible cylinders, and the boom."""
        length, rate, bend = self.drive(time)
        boom = self.model.place(q)
        energy, constraints = segments.energy(self.model, boom, length)
        n, closures = len(q), len(boom.closures)
        rows, turning = [], []
        for m in boom.masses:
            for size, axis in ((m.mass, m.x), (m.mass, m.y), (m.inertia, m.turn)):
                rows.append(np.sqrt(size) * axis.g)
                turning.append(np.sqrt(size) * (v @ axis.h @ v))
        jacobian = np.array(rows)
        force = -energy.g - jacobian.T @ np.array(turning) - self._damping(boom, v, rate)
        driven = [b for joint, b in zip(self.scene.joints, bend, strict=True) if not joint.cylinder.is_compressible]
        demand = np.concatenate([np.zeros(closures), driven]) - np.array([v @ c.h @ v for c in constraints])
        g = np.array([c.g for c in constraints]).reshape(-1, n)
        matrix = np.block([[jacobian.T @ jacobian, g.T], [g, np.zeros((len(g),) * 2)]])
        solution = np.linalg.solve(matrix, np.concatenate([force, demand]))
        return solution[:n], solution[n + closures :], boom

    def _damping(self, boom, v, rate):
        force = np.zeros(len(v))
        for _, damping, elongation in boom.springs:
            force += damping * (elongation.g @ v) * elongation.g
        for joint, length, speed in zip(self.scene.joints, boom.lengths, rate, strict=True):
            if joint.cylinder.d:
                force += joint.cylinder.d * (length.g @ v - speed) * length.g
        return force

    def solve(self, times, angles, tolerance=1e-11):
        """From rest in equilibrium; rows of joints (n), cylinder forces (n), tip x, y, turn and their accelerations."""
        q, *_ = segments.equilibrium(self.model, self.drive(times[0])[0], angles)
        size = len(q)

        def rates(time, state):
            a, _, _ = self.accelerations(time, state[:size], state[size:])
            return np.concatenate([state[size:], a])

        span = (times[0], times[-1])
        start = np.concatenate([q, np.zeros(size)])
        found = solve_ivp(rates, span, start, "DOP853", t_eval=times, rtol=tolerance, atol=1e-3 * tolerance)
        return np.array([self._row(t, y[:size], y[size:]) for t, y in zip(times, found.y.T, strict=True)])

    def _row(self, time, q, v):
        a, multipliers, boom = self.accelerations(time, q, v)
        length, rate, _ = self.drive(time)
        forces = segments.cylinder_forces(self.scene, boom, length, multipliers)
        for i, joint in enumerate(self.scene.joints):
            forces[i] += (joint.cylinder.d or 0.0) * (boom.lengths[i].g @ v - rate[i])
        joints = [joint.v for joint in boom.joints]
        tip = [part.v for part in boom.tip]
        return np.array([*joints, *forces, *tip, *(part.g @ a + v @ part.h @ v for part in boom.tip)])


STEPS = (4e-3, 2e-3, 1e-3, 5e-4)
DURATION, SAMPLES = 0.32, 8


def two_sections(kind, incompressible):
    """Rigid sections 1 and 2 of the default scene, joined by `kind`; cylinders and links have mass."""
    spec = booms.document()
    spec["sections"] = [section | {"modes": 0} for section in spec["sections"][:2]]
    spec["joints"] = [spec["joints"][0], next(joint for joint in spec["joints"] if joint["kind"] == kind)]
    if incompressible:
        for joint in spec["joints"]:
            del joint["cylinder"]["k"], joint["cylinder"]["d"]
    return booms.scene_of(spec)


def three_sections():
    """B3 after B2; massless barrel, rod and link, one undamped and one incompressible cylinder, load, inclined base."""
    spec = booms.document()
    spec["sections"] = [section | {"modes": 0} for section in spec["sections"][:3]]
    spec["joints"] = [spec["joints"][i] for i in (0, 2, 3)]
    del spec["joints"][0]["cylinder"]["d"], spec["joints"][0]["cylinder"]["barrel"], spec["joints"][1]["mR"]
    del spec["joints"][1]["cylinder"]["k"], spec["joints"][1]["cylinder"]["d"], spec["joints"][2]["cylinder"]["rod"]
    spec |= {"tip": {"payload": 50.0}, "line_fill": 9.0}
    spec["base"] |= {"inclination": -0.15}
    return booms.scene_of(spec)


def errors(scene, angles, travel, steps):
    """Errors (len(steps), 4) of joints, forces (relative), tip, tip acceleration, and the sizes of the last."""
    start = segments.Segments(scene, 0).lengths(angles)
    drive = motions.smooth_drive(start, travel, 0.3)
    expected = Lagrange(scene, drive).solve(np.linspace(0.0, DURATION, SAMPLES + 1), angles)
    n = len(angles)
    joints, forces, tip, acceleration = np.split(expected, [n, 2 * n, 2 * n + 3], axis=1)
    table = []
    for step in steps:
        count = round(DURATION / step)
        rows = motions.follow(scene, drive, angles, step, count, count // SAMPLES)
        table.append(
            [
                np.abs(rows[:, :n] - joints).max(),
                np.max(np.abs(rows[:, n : 2 * n] - forces).max(axis=0) / np.abs(forces).max(axis=0)),
                np.abs(rows[:, 2 * n : 2 * n + 3] - tip).max(),
                np.abs(rows[:, 2 * n + 6 : 2 * n + 9] - acceleration).max(),
            ]
        )
    return np.array(table), np.abs(acceleration).max()


def slopes(table):
    return np.log2(table[:-1] / table[1:])


# the kinds differ by their geometry, which is that of the incompressible ones below
@pytest.mark.parametrize("kind", ["B1", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("B2", "B3"))])
def test_oil_springs(kind):
    table, size = errors(two_sections(kind, False), np.array([0.6, -0.9]), [0.03, -0.02], STEPS)
    assert np.all(np.abs(slopes(table) - 2.0) < 0.1)
    assert np.all(table[-1] < [5e-6, 2e-4, 2e-5, 2e-4 * size])


@pytest.mark.parametrize("kind", ["B1", "B2", "B3"])
def test_incompressible_cylinders(kind):
    """Kinematics are then exact at any step, but for what passes leave; forces and accelerations have the integrator's order.

    Passes leave a share of a step's own error (`boom_twin.kernels.transfer.kept_tangent`): some 1e-10 rad at 4 ms.
    """
    table, size = errors(two_sections(kind, True), np.array([0.6, -0.9]), [0.03, -0.02], STEPS)
    assert np.all(table[:, [0, 2]] < 1e-9) and np.all(table[2:, [0, 2]] < 1e-11)
    assert np.all(np.abs(slopes(table[:, [1, 3]]) - 2.0) < 0.2)
    assert np.all(table[-1, [1, 3]] < [5e-5, 5e-5 * size])


def test_elastic_base():
    """Its turn has no inertia but that of cylinder 1: 50 Hz beside the 1 Hz of the boom."""
    scene = booms.on_elastic_base(two_sections("B1", False), 5.0e6, 5.0e4)
    table, size = errors(scene, np.array([0.6, -0.9]), [0.03, -0.02], STEPS)
    assert np.all(np.abs(slopes(table) - 2.0) < 0.1)
    assert np.all(table[-1] < [5e-6, 2e-4, 2e-5, 2e-4 * size])


def test_mixed_boom():
    table, size = errors(three_sections(), np.array([0.8, -0.7, -0.5]), [0.02, -0.02, 0.03], STEPS[1:])
    assert np.all(np.abs(slopes(table) - 2.0) < 0.2)
    assert np.all(table[-1] < [2e-5, 2e-3, 1e-4, 1e-3 * size])
