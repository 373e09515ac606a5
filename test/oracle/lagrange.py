"""Motion of the finite-segment boom as an ordinary differential equation: Lagrange's equations with multipliers.

    M q'' + J^T (J' q') + dV/dq + dissipation + G^T lambda = 0,     G q'' + q'.(d2g) q' - l_ref'' = 0 ,

solved for q'' and lambda at every call and integrated by an explicit Runge-Kutta method of order 8. With fineness 0 it
is a multibody system of rigid bodies. No discretisation of time or of constraints is shared with the model.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from . import segments
from .segments import Segments, cylinder_forces, equilibrium


class Lagrange:
    """Equations of motion of a scene; `drive`: time -> lengths, rates, accelerations, each (n,); `fineness`: see `Segments`."""

    def __init__(self, scene, drive, fineness=0):
        self.scene, self.drive, self.model = scene, drive, Segments(scene, fineness)

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
        q, *_ = equilibrium(self.model, self.drive(times[0])[0], angles)
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
        forces = cylinder_forces(self.scene, boom, length, multipliers)
        for i, joint in enumerate(self.scene.joints):
            forces[i] += (joint.cylinder.d or 0.0) * (boom.lengths[i].g @ v - rate[i])
        joints = [joint.v for joint in boom.joints]
        tip = [part.v for part in boom.tip]
        return np.array([*joints, *forces, *tip, *(part.g @ a + v @ part.h @ v for part in boom.tip)])
