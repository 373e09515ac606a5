"""The boom's equations written out over all unknowns at once, without any condensing: residual by differences.

Only positions come from the model (`place`). Forces of mass points, beams, cylinders and closures are put together as a
gradient by all unknowns; the increments of the sweeps have to solve this large linearised system.
"""

from __future__ import annotations

import numpy as np

from boom_twin.kernels.elements.cylinder import compliance_and_lag
from boom_twin.kernels.tables import JOINT_B
from boom_twin.kernels.transfer.forward_kinematics import place
from boom_twin.kernels.transfer.riccati_sweep import FREE, ROOT, clear_cut, sweep_in, sweep_out

NUDGE = 2e-4  # rad, of differences whose error is of its fourth power


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
        operations = plan.tables.operations
        self.six_bars = np.flatnonzero(operations.kind == JOINT_B)
        self.rows = operations.row[self.six_bars]

    def positions(self, z):
        """All histories, then both closures of every six-bar."""
        self.state.z[:] = z
        place(self.plan.tables, self.state, self.work)
        places, links = self.plan.tables.joints["z"][self.rows], self.plan.tables.linkages[self.rows]
        heads = self.state.frames[self.six_bars, 2]
        left = (links["dx"] + 1j * links["dy"]) * np.exp(1j * heads) + links["length_l"] * np.exp(1j * z[places + 1])
        right = (links["ex"] + 1j * links["ey"]) * np.exp(1j * z[places]) + links["length_r"] * np.exp(1j * z[places + 2])
        return np.concatenate([self.work.position, (left - right).view(float)])

    def residual(self, z):
        """Generalised forces of all coordinates, closures, and laws of the cylinders; zero in a solution."""
        t, at = self.plan.tables, self.positions(z)
        histories = len(self.plan.masses)
        force = np.zeros(len(at))
        force[:histories] = self.plan.masses * self.motion.gain * (at[:histories] - self.motion.hat) - self.plan.weights
        for cylinder in t.cylinders:
            force[cylinder.history] += z[cylinder.z]
        for k, joint in enumerate(t.joints[1:]):
            force[histories + 2 * k : histories + 2 * k + 2] += z[joint.z + 3 : joint.z + 5]
        # closures and lengths do not depend on forces, so rows of forces are still empty
        total = np.array([slope @ force for slope in slopes(self.positions, z)])
        rates = self.motion.rate * at[:histories] + self.motion.offset
        for hinge in t.hinges:
            total[hinge.z] += hinge.stiffness * z[hinge.z] + hinge.damping * rates[hinge.z]
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
            compliance, lag = compliance_and_lag(cylinder, t.oils, self.drive[i])
            total[cylinder.z] = at[cylinder.history] - self.drive[i] + lag * speed - compliance * z[cylinder.z]
        return total

    def left_by(self, z, dz):
        """What the linearised equations leave of the residual at z after the increments dz, and the residual itself."""
        share = 1e-3
        slope = (self.residual(z + share * dz) - self.residual(z - share * dz)) / (2 * share)
        now = self.residual(z)
        return now + slope, now


def slopes(function, z):
    """Derivatives by every entry of z, one after the other; central differences over one and two nudges."""
    for i in range(len(z)):
        ends = []
        for share in (1.0, -1.0, 2.0, -2.0):
            moved = z.copy()
            moved[i] += share * NUDGE
            ends.append(function(moved))
        yield (8.0 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12.0 * NUDGE)
