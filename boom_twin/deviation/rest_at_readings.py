"""Boom at rest where its sensors read given values: drives and joint angles, by statics on cylinders held at a length."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..analysis.drive import spring_free
from ..analysis.equilibrium import settle
from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..errors import UsageError
from ..kernels.tables import FRAME_ANGLE, FRAME_X, FRAME_Y, State
from ..scene.edit import with_rigid_cylinders
from ..scene.kinematics import joint_angles_of_strokes, strokes_of_angles
from ..scene.schema import Scene
from ..types import GIVE, Array, StrokeReading
from .posture import Posture
from .sensor_model import TURN

PASSES, SAME = 20, 1e-10  # passes for the boom at rest by its angle sensors, until they read the same, rad


class Rest(NamedTuple):
    """Boom at rest: drives (n,) in m, joint angles (n,) of the rigid boom in rad, readings (n,) without whole turns."""

    drives: Array
    angles: Array
    readings: Array


class RestFinder:
    """Finder of the boom at rest by the readings of what drives the model.

    Parameters
    ----------
    scene : Scene
        With its load.
    plan : Plan
        Compiled scene.
    posture : Posture
        Its mounts of angle sensors are used.
    reads : StrokeReading
        What drives the model.
    """

    def __init__(self, scene: Scene, plan: Plan, posture: Posture, reads: StrokeReading) -> None:
        self._scene, self._plan, self._posture, self._reads = scene, plan, posture, reads
        self._struts = compile_scene(with_rigid_cylinders(scene))

    def rest_at(self, readings: Array) -> Rest:
        """Return the boom at rest where what drives the model reads `readings` (m or rad), shape (n,).

        Raises
        ------
        UsageError, SolverError
            Lengths or angles out of reach; no equilibrium there.
        """
        held = self._struts.state()
        if self._reads is StrokeReading.ANGLE:
            lengths, angles = self._hold_angles(held, readings)
            readings = readings - TURN * np.rint((readings - self._angles_in(held)) / TURN) * self._posture.absolute
        else:
            lengths, angles = readings, joint_angles_of_strokes(self._scene, readings)
            if self._reads is StrokeReading.DRIVE:
                return Rest(lengths, angles, readings)
            settle(self._struts, held, self._struts.work(), lengths, angles)
        forces = self._struts.observed(held).cylinder_forces
        return Rest(spring_free(self._plan, lengths, forces), angles, readings)

    def tip_at(self, readings: Array) -> Array:
        """Return x, y (m) and angle (rad) of the tip at rest where what drives the model reads `readings`; see `rest_at`."""
        rest, boom = self.rest_at(readings), self._plan.state()
        settle(self._plan, boom, self._plan.work(), rest.drives, rest.angles)
        return boom.frames[-1, [FRAME_X, FRAME_Y, FRAME_ANGLE]]

    def readings_at(self, lengths: Array) -> Array:
        """Return what drives the model reads at rest with cylinder `lengths` (m), shape (n,)."""
        if self._reads is not StrokeReading.ANGLE:
            return lengths
        held = self._struts.state()
        settle(self._struts, held, self._struts.work(), lengths, joint_angles_of_strokes(self._scene, lengths))
        return self._angles_in(held)

    def _hold_angles(self, held: State, readings: Array) -> tuple[Array, Array]:
        """Settle `held` where angle sensors read `readings` (rad); return lengths and angles of joints.

        The angle of a joint with an encoder is its reading. Inclinometers read the bending inboard, too, which is subtracted.
        """
        p, work = self._posture, self._struts.work()
        joints, off = np.zeros(len(readings)), readings - p.tilt
        for _ in range(PASSES):
            turned = 0.0
            for i, joint in enumerate(self._scene.joints):
                low, high = np.radians(joint.range_deg)
                step = off[i] - (turned if p.absolute[i] else 0.0)
                step -= TURN * np.rint((joints[i] + step - 0.5 * (low + high)) / TURN) if p.absolute[i] else 0.0
                joints[i], turned = joints[i] + step, turned + step
                if not low - GIVE <= joints[i] <= high + GIVE:
                    raise UsageError(
                        f"joint_{i + 1} = {math.degrees(joints[i]):.4g} deg: its range_deg is {joint.range_deg[0]:g} to "
                        f"{joint.range_deg[1]:g}. Check its sensor's unit, sign and zero in the mapping."
                    )
            lengths = strokes_of_angles(self._scene, joints)
            settle(self._struts, held, work, lengths, joints)
            off = readings - self._angles_in(held)
            off -= TURN * np.rint(off / TURN) * p.absolute
            if np.abs(off).max() < SAME:
                break
        return lengths, joints

    def _angles_in(self, state: State) -> Array:
        """Return what angle sensors read of a boom at rest, rad, shape (n,)."""
        p, angles = self._posture, state.frames[:, FRAME_ANGLE]
        return np.where(p.absolute, angles[p.frames], angles[p.roots[:-1]] - angles[p.roots[:-1] - 1]) + p.tilt
