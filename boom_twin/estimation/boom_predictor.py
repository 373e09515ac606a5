"""Predict the boom from stroke samples: steps the compiled boom under one load and gives a `Prediction` for every sample."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from ..analysis.bending_moments import moments_by_unknowns
from ..analysis.equilibrium import outline, set_undeformed, settle
from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..config.settings import Settings
from ..kernels.elements.linkage import cylinder_length
from ..kernels.result_row import PIN, places_in, prediction_width
from ..kernels.tables import State
from ..kernels.transfer.forward_kinematics import place
from ..scene.kinematics import joint_angles_of_strokes, rigid_chain
from ..scene.schema import Scene
from ..types import Array, Prediction
from .look_ahead import Tuning, follow, new_track


class UndeflectedPredictor:
    """Where the points of `boom_twin.analysis.equilibrium.outline` are while nothing bends."""

    def __init__(self, scene: Scene, plan: Plan) -> None:
        self._plan, self._pivot = plan, np.array(scene.base.pivot)
        self._lengths = np.array([section.length for section in scene.sections])
        self._reach = np.concatenate([[0.0], np.cumsum(self._lengths)])
        self._middle = np.radians([sum(joint.range_deg) / 2 for joint in scene.joints])

    def at(self, angles: Array) -> Array:
        """Points (k, 2), m, at relative joint `angles` (rad), shape (n,)."""
        _, pivots = rigid_chain(self._pivot, self._lengths, angles)
        return np.stack([np.interp(self._along, self._reach, column) for column in pivots.T], axis=1)

    @cached_property
    def _along(self) -> Array:
        """How far along the sections every point is, m, shape (k,): all pivots are among the points."""
        state, work = self._plan.state(), self._plan.work()
        set_undeformed(self._plan, state, self._middle)
        place(self._plan.tables, state, work)
        line = outline(self._plan, state, work.position)
        steps = np.hypot(*np.diff(line, axis=0, prepend=self._pivot[None, :]).T)
        return np.asarray(np.cumsum(steps))


PAUSE = 0.1  # s without strokes, after which
TINY = 1e-12
AFTER_PAUSE = 0.15  # s of strokes come before the remembered boom is stepped over it: they tell how the pause ended


class BoomPredictor:
    """A boom that remembers how it moved.

    Parameters
    ----------
    scene : Scene
        With its load.
    settings : Settings
        Noise of the strokes, tuning of the estimator.

    Attributes
    ----------
    plan : Plan
    live : State
        The boom as predicted by the newest sample.
    """

    def __init__(self, scene: Scene, settings: Settings) -> None:
        self._scene, self.plan = scene, compile_scene(scene)
        self.live: State = self.plan.state()
        self._anchor, self._work = self.plan.state(), self.plan.work()
        self._undeflected, self._bending = UndeflectedPredictor(scene, self.plan), moments_by_unknowns(self.plan)
        self._track = new_track(self.plan, np.array([section.length for section in scene.sections]))
        self._tuning = Tuning(
            settings.stroke_variance, settings.jerk_density, settings.lag, settings.step, settings.look_step, settings.rho
        )
        self._patient = self._tuning._replace(lag=max(AFTER_PAUSE, settings.lag))
        self._newest, self._paused = 0.0, -math.inf
        size = self.plan.joints, len(self.plan.pins)
        self._row = np.zeros(prediction_width(*size))
        self._at = places_in(*size)

    @property
    def variances(self) -> Array:
        """Of the newest strokes' estimates, m^2, shape (n,)."""
        return self._row[self._at.variances]

    @property
    def angles(self) -> Array:
        """Joint angles (rad) of the rigid boom at the newest strokes, shape (n,)."""
        return self._track.angles

    @property
    def passes(self) -> int:
        """Newton passes that the newest sample took."""
        return int(self._track.passes[0])

    def slope(self, joint: int) -> float:
        """Stroke over angle of joint `joint` (0-based), m/rad, by rigid geometry at the newest strokes."""
        return float(cylinder_length(self.plan.tables.linkages[joint], self._track.angles[joint])[1])

    def start(self, strokes: Array) -> None:
        """Forget all; at rest in equilibrium at `strokes` (m), shape (n,).

        Raises
        ------
        UsageError, SolverError
            Strokes out of reach; no equilibrium there.
        """
        angles = joint_angles_of_strokes(self._scene, strokes)
        settle(self.plan, self._anchor, self._work, strokes, angles)
        self._track.angles[:] = angles
        self._track.nodes[0] = 0
        self._newest, self._paused = 0.0, -math.inf

    def step(self, time: float, strokes: Array) -> int:
        """Go on to strokes (m; NaN = missing) measured at `time` (s since the start); a status of `kernels.tables`."""
        if time - self._newest > PAUSE:
            self._paused = time
        self._newest = time
        tuning = self._patient if time - self._paused < AFTER_PAUSE else self._tuning
        tables, work = self.plan.tables, self._work
        return int(follow(tables, self._anchor, self.live, work, self._track, tuning, time, strokes, self._row))

    def extrapolated(self, span: float) -> Array:
        """Strokes (m) `span` s after the newest sample, by its estimates; shape (n,)."""
        x = self._track.x[0]
        return np.asarray(x[:, 0] + span * (x[:, 1] + 0.5 * span * x[:, 2]))

    @property
    def speeds(self) -> Array:
        """Of the strokes at the newest sample, as estimated, m/s, shape (n,)."""
        return np.asarray(self._track.x[0][:, 1])

    def least_way(self, span: float, sure: float) -> float:
        """How far (m) the fastest stroke goes on for `span` s at least, unless it brakes harder than it now does.

        Speeds and braking are taken `sure` deviations to the safe side.
        """
        x, c = self._track.x[0], self._track.c[0]
        deviations = np.sqrt(np.maximum(c.diagonal(axis1=1, axis2=2), 0.0))
        speeds = np.maximum(np.abs(x[:, 1]) - sure * deviations[:, 1], 0.0)
        braking = np.maximum(-x[:, 2] * np.sign(x[:, 1]), 0.0) + sure * deviations[:, 2]
        return float(np.minimum(speeds * span, speeds**2 / (2.0 * np.maximum(braking, TINY))).max())

    def prediction(self, stamp: int, shaped: bool) -> Prediction:
        """What the newest sample gave; with centre lines and cylinder pins if `shaped`."""
        row, at = self._row.copy(), self._at
        tip = row[at.tip].reshape(3, 3)
        angle, angular_velocity, angular_acceleration = tip[:, 2].tolist()
        position = tip[0, :2]
        return Prediction(
            stamp=stamp,
            tip_position=position,
            tip_displacement=position - row[at.rigid_tip],
            tip_velocity=tip[1, :2],
            tip_acceleration=tip[2, :2],
            tip_angle=angle,
            tip_angular_velocity=angular_velocity,
            tip_angular_acceleration=angular_acceleration,
            joints=row[at.joints],
            strokes=row[at.strokes],
            cylinder_forces=row[at.cylinder_forces],
            shape=outline(self.plan, self.live, self._work.position) if shaped else None,
            undeflected=self._undeflected.at(self.angles) if shaped else None,
            pins=self.live.pins.copy() if shaped else None,
            clearances=row[at.pins].reshape(-1, PIN),
            moments=self._bending @ self.live.z,
        )
