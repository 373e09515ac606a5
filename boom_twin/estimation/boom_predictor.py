"""Predict the boom from stroke samples: steps the compiled boom under one load and gives a `Prediction` for every sample."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..analysis.bending_moments import moments_by_unknowns
from ..analysis.equilibrium import outline, set_undeformed, settle
from ..compiler.compile import compile_scene
from ..compiler.plan import Plan
from ..kernels.elements.linkage import cylinder_length
from ..kernels.jit import hold
from ..kernels.result_row import PIN, places_in, prediction_width
from ..kernels.tables import State, Tables, Tangents, Work
from ..kernels.transfer.forward_kinematics import place
from ..scene.kinematics import joint_angles_of_strokes, rigid_chain
from ..scene.schema import Scene
from ..types import Array, Outline, Prediction
from .look_ahead import STEPS, Track, new_track
from .recorded_steps import step_width
from .stroke_filter import forget_integrals


class UndeflectedPredictor:
    """Where the points of `boom_twin.analysis.equilibrium.outline` are while nothing bends."""

    def __init__(self, scene: Scene, plan: Plan) -> None:
        self._plan, self._pivot = plan, np.array(scene.base.pivot)
        self._lengths = np.array([section.length for section in scene.sections])
        self._reach = np.concatenate([[0.0], np.cumsum(self._lengths)])
        along = self._points_along(np.radians([sum(joint.range_deg) / 2 for joint in scene.joints]))
        self._section = np.clip(np.searchsorted(self._reach, along, side="right") - 1, 0, len(self._lengths))
        self._beyond = np.where(self._section < len(self._lengths), np.maximum(along - self._reach[self._section], 0.0), 0.0)

    def at(self, angles: Array) -> Array:
        """Points (.., k, 2), m, at relative joint `angles` (rad), shape (.., n)."""
        _, pivots = rigid_chain(self._pivot, self._lengths, angles)
        steps = np.diff(pivots, axis=-2) / np.diff(self._reach)[:, None]
        steps = np.concatenate([steps, np.zeros_like(steps[..., :1, :])], axis=-2)
        return np.asarray(steps[..., self._section, :] * self._beyond[:, None] + pivots[..., self._section, :])

    def _points_along(self, angles: Array) -> Array:
        """How far along the sections every point is, m, shape (k,): all pivots are among the points; found at some angles."""
        state, work = self._plan.state(), self._plan.work()
        set_undeformed(self._plan, state, angles)
        place(self._plan.tables, state, work)
        line = outline(self._plan, state.frames, work.position)
        steps = np.hypot(*np.diff(line, axis=0, prepend=self._pivot[None, :]).T)
        return np.asarray(np.cumsum(steps))


TINY = 1e-12


class Drawn(NamedTuple):
    """A boom at one instant, as far as its outline needs it.

    frames, positions : of `State` and `Work`. angles : (n,) joint angles of the rigid boom, rad. pins : (n, 4) of `State`.
    """

    frames: Array
    positions: Array
    angles: Array
    pins: Array


class CompiledBoom(NamedTuple):
    """A boom as kernels take it.

    tables : of the scene. anchor, live : the boom that is remembered, and as predicted by the newest sample. work : scratch.
    tangents : that steps keep from sample to sample.
    track : see `boom_twin.estimation.look_ahead.Track`. bending : (stations, unknowns) bending moments by the unknowns, N m.
    row : the newest prediction, see `boom_twin.kernels.result_row`.
    """

    tables: Tables
    anchor: State
    live: State
    work: Work
    tangents: Tangents
    track: Track
    bending: Array
    row: Array


class BoomPredictor:
    """A boom that remembers how it moved.

    Parameters
    ----------
    scene : Scene
        With its load.

    Attributes
    ----------
    plan : Plan
    live : State
        The boom as predicted by the newest sample.
    compiled : CompiledBoom
        The same for kernels; `boom_twin.twin.update` steps it.
    places : Places
        Where everything stands in a row of a prediction.
    pins : int
        Pins with clearance.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self.plan = scene, compile_scene(scene)
        self.live: State = self.plan.state()
        self._anchor, self._work = self.plan.state(), self.plan.work()
        self._undeflected = UndeflectedPredictor(scene, self.plan)
        self._track = new_track(self.plan, np.array([section.length for section in scene.sections]))
        self.pins = len(self.plan.pins)
        size = self.plan.joints, self.pins
        self._row = np.zeros(prediction_width(*size))
        self.places = places_in(*size)
        tangents, bending = self.plan.tangents(int(STEPS)), moments_by_unknowns(self.plan)
        self.compiled = CompiledBoom(
            self.plan.tables, self._anchor, self.live, self._work, tangents, self._track, bending, self._row
        )

    @cached_property
    def held(self) -> tuple[Any, ...]:
        """`compiled` as compiled code takes it with every call, see `boom_twin.kernels.jit.hold`."""
        return tuple(map(hold, self.compiled))

    @property
    def variances(self) -> Array:
        """Of the newest strokes' estimates, m^2, shape (n,)."""
        return self._row[self.places.variances]

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

    def extrapolated(self, span: float) -> Array:
        """Strokes (m) `span` s after the newest sample, by its estimates; shape (n,)."""
        x = self._track.bank.nodes[0]
        return np.asarray(x[:, 0] + span * (x[:, 1] + 0.5 * span * x[:, 2]))

    @property
    def speeds(self) -> Array:
        """Of the strokes at the newest sample, as estimated, m/s, shape (n,)."""
        return np.asarray(self._track.bank.nodes[0][:, 1])

    def least_way(self, span: float, sure: float) -> float:
        """How far (m) the fastest stroke goes on for `span` s at least, unless it brakes harder than it now does.

        Speeds and braking are taken `sure` deviations to the safe side.
        """
        x, c = self._track.bank.nodes[0], self._track.bank.covariance
        deviations = np.sqrt(np.maximum(c.diagonal(axis1=1, axis2=2), 0.0))
        speeds = np.maximum(np.abs(x[:, 1]) - sure * deviations[:, 1], 0.0)
        braking = np.maximum(-x[:, 2] * np.sign(x[:, 1]), 0.0) + sure * deviations[:, 2]
        return float(np.minimum(speeds * span, speeds**2 / (2.0 * np.maximum(braking, TINY))).max())

    def take_filtered(self) -> tuple[Array, Array]:
        """How strokes were filtered since this was called last: probabilities (n, m) of their densities, excess (n,) in m^2.

        See `boom_twin.estimation.stroke_filter.StrokeFilter`.
        """
        bank = self._track.bank
        span = float(bank.span[0])
        found = (bank.shares / span, bank.excesses / span) if span else (bank.weights.copy(), np.zeros(len(bank.weights)))
        forget_integrals(bank)
        return found

    @property
    def step_width(self) -> int:
        """Most numbers that a step leaves, see `boom_twin.estimation.recorded_steps`."""
        return step_width(self.live, self._work, self._track, self._row)

    @property
    def is_lost(self) -> bool:
        """Whether a stroke came to move, with the newest sample, in a way that its filter cannot follow."""
        return bool(self._track.bank.began[0])

    @property
    def estimate(self) -> Array:
        """Strokes (m) as estimated at the newest sample, shape (n,)."""
        return self._row[self.places.strokes]

    @property
    def drawn(self) -> Drawn:
        """What an outline at the newest sample needs: to be kept, and made `outlines` of with others."""
        return Drawn(self.live.frames.copy(), self._work.position.copy(), self.angles.copy(), self.live.pins.copy())

    def outlines(self, drawn: Sequence[Drawn]) -> list[Outline]:
        """Centre lines and cylinder pins at several samples, at least one."""
        frames, positions, angles, _ = map(np.array, zip(*drawn, strict=True))
        lines = outline(self.plan, frames, positions), self._undeflected.at(angles)
        return [Outline(shape, undeflected, each.pins) for shape, undeflected, each in zip(*lines, drawn, strict=True)]

    def prediction(self, stamp: int, drawn: Outline | None = None, moments: Array | None = None) -> Prediction:
        """What the newest sample gave, with an outline and bending moments (N m) if they are given."""
        return self.prediction_in(self._row.copy(), stamp, drawn, moments)

    def prediction_in(self, row: Array, stamp: int, drawn: Outline | None = None, moments: Array | None = None) -> Prediction:
        """The same of a row, of which its arrays are views; see `boom_twin.kernels.result_row`."""
        at = self.places
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
            shape=None if drawn is None else drawn.shape,
            undeflected=None if drawn is None else drawn.undeflected,
            pins=None if drawn is None else drawn.pins,
            clearances=row[at.pins].reshape(-1, PIN),
            moments=moments,
        )
