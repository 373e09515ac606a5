"""The boom's equations written out over all unknowns at once, without any condensing: residual by differences.

Only positions come from the model (`place`). Forces of mass points, beams, cylinders and closures are put together as a
gradient by all unknowns; the increments of the sweeps have to solve this large linearised system.
"""

from __future__ import annotations

import numpy as np

from boom_twin.chain.place import place
from boom_twin.chain.program import JOINT_B
from boom_twin.chain.sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out

NUDGE = 1e-5  # rad


def riccati_pass(plan, state, work, motion, drive, drive_rate):
    """One pass of the sweeps over the whole boom: increments into `work.dz`."""
    end = np.int64(len(plan.tables.operations))
    clear_cut(work, FREE)
    status, _, _ = sweep_in(plan.tables, state, work, motion, drive, drive_rate, ROOT, end, FREE)
    sweep_out(plan.tables, state, work, ROOT, end, FREE)
    return status


class Dense:
    """Equations of a plan for one motion (gain, rate, hat, offset) and one drive."""

    def __init__(self, plan, motion, drive, drive_rate):
        self.plan, self.motion, self.drive, self.drive_rate = plan, motion, drive, drive_rate
        self.state, self.work = plan.state(), plan.work()

    def positions(self, z):
        """All histories, then both closures of every six-bar."""
        self.state.z[:] = z
        place(self.plan.tables, self.state, self.work)
        t, gaps = self.plan.tables, []
        for operation, frame in zip(t.operations, self.state.frames, strict=False):
            if operation.kind == JOINT_B:
                joint, link = t.joints[operation.row], t.linkages[operation.row]
                d, e = complex(link.dx, link.dy), complex(link.ex, link.ey)
                left = d * np.exp(1j * frame[2]) + link.length_l * np.exp(1j * z[joint.z + 1])
                right = e * np.exp(1j * z[joint.z]) + link.length_r * np.exp(1j * z[joint.z + 2])
                gaps += [(left - right).real, (left - right).imag]
        return np.concatenate([self.work.position, gaps])

    def residual(self, z):
        """Generalised forces of all coordinates, closures, and laws of the cylinders; zero in a solution."""
        t, at = self.plan.tables, self.positions(z)
        slopes = differences(self.positions, z)
        histories = len(self.plan.masses)
        force = np.zeros(len(at))
        force[:histories] = self.plan.masses * self.motion.gain * (at[:histories] - self.motion.hat) - self.plan.weights
        for cylinder in t.cylinders:
            force[cylinder.history] += z[cylinder.z]
        for k, joint in enumerate(t.joints[1:]):
            force[histories + 2 * k : histories + 2 * k + 2] += z[joint.z + 3 : joint.z + 5]
        # closures and lengths do not depend on forces, so rows of forces are still empty
        total = slopes.T @ force
        rates = self.motion.rate * at[:histories] + self.motion.offset
        for row, beam in enumerate(t.beams):
            places = slice(beam.z, beam.z + beam.bending)
            lead = z + beam.beta * rates[: len(z)] * (beam.damped > 0)
            total[places] += t.stiffness[row, : beam.bending, : beam.bending] @ lead[places]
            if beam.axial:
                total[beam.z + beam.bending] += beam.axial_stiffness * lead[beam.z + beam.bending]
        for k, joint in enumerate(t.joints[1:]):
            total[joint.z + 3 : joint.z + 5] = at[histories + 2 * k : histories + 2 * k + 2]
        for i, cylinder in enumerate(t.cylinders):
            speed = rates[cylinder.history] - self.drive_rate[i]
            law = at[cylinder.history] - self.drive[i] + cylinder.lag * speed - cylinder.compliance * z[cylinder.z]
            total[cylinder.z] = law
        return total

    def left_by(self, z, dz):
        """What the linearised equations leave of the residual at z after the increments dz, and the residual itself."""
        share = 1e-3
        slope = (self.residual(z + share * dz) - self.residual(z - share * dz)) / (2 * share)
        now = self.residual(z)
        return now + slope, now


def differences(function, z):
    """Central differences, columns by z."""
    columns = []
    for i in range(len(z)):
        up, down = z.copy(), z.copy()
        up[i] += NUDGE
        down[i] -= NUDGE
        columns.append((function(up) - function(down)) / (2 * NUDGE))
    return np.stack(columns, axis=-1)
