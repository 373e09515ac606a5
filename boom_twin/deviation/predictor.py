"""Predict a boom by what drives it and estimate its tip by all sensors: the filters of `models` in a run."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.bending_stress import moments_by_unknowns
from ..analysis.equilibrium import outline, settle
from ..analysis.modal import natural_modes
from ..analysis.undeflected import UndeflectedBoom
from ..compiler.compile import compile_scene
from ..config.settings import Settings
from ..errors import SolverError, UsageError
from ..kernels.result_row import places_in, prediction_width
from ..kernels.tables import OK, SENTENCES, State, Tables, Work
from ..predictions import Outline
from ..scene.kinematics import RigidJoints
from ..scene.schema import Scene
from ..scene.summary import weight_of
from ..types import NO_PLACES, SENSORS, Array, Mount, Place, Stream, StrokeReading, channels_of, streams_of
from .channels import READS_MOMENT, TIP_IMU_STATES, measurement_of
from .estimate_row import MODES
from .kalman import FORCE_ZERO
from .models import start_models
from .named_faults import FaultyBoom, NamedFaults
from .posture import Posture, linearise, new_posture
from .rest_at_readings import RestFinder
from .sensor_errors import SensorErrors
from .sensor_model import mounting_of
from .states import DOUBTS, FED, Filters, Innovations, SensorNoise, drive_place, new_filters
from .tip_estimate import write_predicted_covariance

HIGHEST = 25.0  # Hz; what is faster follows load and drives without vibration of its own
GAUGE_DRIFT = 0.03  # share of the moment in a root second, by which the zero of a strain gauge drifts
WIDTH = 1e-6  # relative accuracy of natural frequencies
LEAST_LOAD, FIRST_LOAD, BURST_LOAD = 1e-4, 2e-3, 2e-2  # shares of the boom's weight, see `SensorNoise`
FAILED_WAY, FAILED_RATE = 0.05, 0.02  # m, m/s: how far a drive is, and how fast, when its transducer is found to fail
SWING, SPEED = 0.3, 0.05  # how far a boom at work swings, as a share of the tip's deflection; m/s of its cylinders


class Drawn(NamedTuple):
    """State of a boom at one instant, as far as its outline needs it.

    frames, positions : of `State` and `Work`. angles : (n,) joint angles of the rigid boom, rad. pins : (n, 4) of `State`.
    """

    frames: Array
    positions: Array
    angles: Array
    pins: Array


class CompiledBoom(NamedTuple):
    """Compiled boom as `boom_twin.twin.update` takes it.

    tables : of the scene. anchor : the boom at rest at the posture. live : the boom as predicted. work : scratch.
    bending : (stations, unknowns) bending moments by the unknowns, N m. row : the newest prediction, see
    `boom_twin.kernels.result_row`.
    """

    tables: Tables
    anchor: State
    live: State
    work: Work
    posture: Posture
    filters: Filters
    bending: Array
    row: Array


class BoomPredictor:
    """Predictor of a boom by its stroke transducers or its angle sensors, and estimator of its tip by all sensors.

    Parameters
    ----------
    scene : Scene
        With its load.
    settings : Settings
    mounts : sequence of Mount or None
        Of the angle sensors.
    reads : StrokeReading
        What drives the model.
    places : mapping of str to Place
        Of sensors that have one, such as ``imu_2``. The tip IMU is at the tip if it is not among them.
    lagging : collection of Stream
        Streams whose lag behind what drives the model is estimated.

    Attributes
    ----------
    plan : Plan
    live : State
        The boom as predicted by the newest sample.
    posture : Posture
    filters : Filters
    finder : RestFinder
    sensors : SensorErrors
    channels : dict of Stream to tuple of str
        Channels of every stream; none of those that the boom does not have.
    compiled : CompiledBoom
    places : Places
        Where everything stands in a row of a prediction.
    pins : int
        Pins with clearance.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        mounts: Sequence[Mount | None] = (),
        reads: StrokeReading = StrokeReading.LENGTH,
        places: Mapping[str, Place] = NO_PLACES,
        lagging: Collection[Stream] = (),
    ) -> None:
        self._joints, self.plan = RigidJoints(scene), compile_scene(scene)
        self.live: State = self.plan.state()
        self._anchor, self._work = self.plan.state(), self.plan.work()
        self._undeflected = UndeflectedBoom(scene, self.plan)
        n, self.pins, weight = self.plan.joints, len(self.plan.pins), weight_of(scene)
        self._row, self.places = np.zeros(prediction_width(n, self.pins)), places_in(n, self.pins)
        self._bending = moments_by_unknowns(self.plan)
        lengths, self._reads = np.array([each.length for each in scene.sections]), reads
        self.channels = channels_of(n, streams_of(places))
        mounting = mounting_of(self.plan, mounts)
        zero = 0.0 if reads is StrokeReading.ANGLE else settings.stroke_zero
        measured = measurement_of(self.plan, settings, mounting, places, lagging, zero)
        self.posture = new_posture(self.plan, MODES, lengths, mounting, measured, reads, scene.base.inclination)
        loads = [size * weight for size in (settings.expected_load, LEAST_LOAD, FIRST_LOAD, BURST_LOAD)]
        kind = SENSORS[reads.stream]
        noise = SensorNoise(settings.variance(kind), zero**2, settings.standing(kind), settings.scene_error, *loads)
        self.filters = new_filters(n, MODES, measured, noise)
        self.finder = RestFinder(scene, self.plan, self.posture, reads)
        self.sensors = SensorErrors(self.posture, self.filters, self.channels)
        self._faults = NamedFaults(self.posture, reads)
        tables, boom = self.plan.tables, (self._anchor, self.live, self._work)
        self.compiled = CompiledBoom(tables, *boom, self.posture, self.filters, self._bending, self._row)

    @property
    def stations(self) -> int:
        """Number of stations that have a bending moment."""
        return len(self._bending)

    @property
    def width(self) -> int:
        """Numbers in a row of a prediction."""
        return len(self._row)

    def start(self, readings: Array, may_move: bool = False) -> Array:
        """Reset to rest in equilibrium where what drives the model reads `readings` (m or rad), shape (n,); return these.

        Whole turns of inclinometers are left out of what is returned.

        Parameters
        ----------
        may_move : bool
            Whether the boom may be at work already. Then all models allow for it, else only that of open valves.

        Raises
        ------
        UsageError, SolverError
            Lengths or angles out of reach; no equilibrium there.
        """
        p, f, boom = self.posture, self.filters, self._anchor
        drives, angles, readings = self.finder.rest_at(readings)
        settle(self.plan, boom, self._work, drives, angles)
        p.angles[:] = angles
        modes = natural_modes(self.plan, boom, self._work, MODES, WIDTH, 2.0 * math.pi * HIGHEST)
        p.modes[0] = len(modes)
        for j, mode in enumerate(modes):
            side = math.copysign(1.0, mode.motion[self.plan.tables.tip + 1])  # a positive coordinate lifts the tip
            p.motions[j], p.columns[2 + self.plan.joints + j] = side * mode.motion, side * mode.increments
            p.omega[j] = 2.0 * math.pi * mode.frequency
        status = linearise(self.plan.tables, boom, self._work, p, drives, False)
        if status != OK:
            raise SolverError(SENTENCES[int(status)])
        self._free_gauges()
        sag = float(np.hypot(*(boom.frames[-1, :2] - self._undeflected.at(angles)[-1])))
        start_models(p, f, SPEED, SWING * sag, may_move)
        return readings

    def _free_gauges(self) -> None:
        """Write how far the zeros of strain gauges may be off, as of forces: by the moment that they bear."""
        p = self.posture
        bent = np.abs(p.bending @ p.rest)
        for row in p.channels[p.channels.kind == READS_MOMENT]:
            error = p.errors[int(row.zero) - TIP_IMU_STATES - 2 * self.plan.joints]
            error.first, error.walk = FORCE_ZERO * (bent[row.index] + 0.1 * bent.max()), GAUGE_DRIFT * bent[row.index]

    @property
    def angles(self) -> Array:
        """Joint angles (rad) of the rigid boom at the newest lengths, shape (n,); those before if one is out of reach."""
        try:
            return self._joints.angles(self.estimate, self.posture.angles)
        except UsageError:
            return self.posture.angles.copy()

    def slope(self, joint: int) -> float:
        """Return stroke over angle of joint `joint` (0-based), m/rad, by rigid geometry."""
        return 1.0 / float(self.posture.slope[joint])

    def extrapolated(self, span: float) -> Array:
        """Return what drives the model (m or rad) `span` s after the newest sample; shape (n,)."""
        x = self.filters.strokes
        return np.asarray(x[:, 0] + span * (x[:, 1] + 0.5 * span * x[:, 2]))

    def expected(self, readings: Array) -> Array:
        """Return the newest of what drives the model (m or rad), shape (n,); of sensors that are left out these readings."""
        return np.where(self.filters.deaf, readings, self.extrapolated(0.0))

    @property
    def speeds(self) -> Array:
        """Rates of what drives the model at the newest sample, as estimated, m/s or rad/s, shape (n,)."""
        return np.asarray(self.filters.strokes[:, 1])

    # -- changes by the twin

    def leave_out(self, masked: NDArray[np.bool_], strokes: NDArray[np.bool_], angles: NDArray[np.bool_]) -> None:
        """Leave masked channels (c,) out of the estimate, and strokes (n,) out of all; restart the estimate if any are new.

        `angles` (n,) are those known to be wrong. Others that are left out contradict the strokes, and either may be wrong.

        The prediction takes the angle sensor of the joint in the place of a stroke that is left out. Without one the drive
        stays where it was believed, and how far it may have moved since grows.
        """
        f, first, n = self.filters, drive_place(self.posture), self.plan.joints
        for i in np.flatnonzero(strokes & ~f.deaf):
            f.is_open[:, i] = 1
            for x, covariance in zip(f.x, f.p, strict=True):
                for at in (first + n + i, first + 2 * n + i):  # its rate and acceleration
                    x[at] = covariance[at] = covariance[:, at] = 0.0
                covariance[first + i, first + i] += FAILED_WAY**2
                covariance[first + n + i, first + n + i] = FAILED_RATE**2
        if (masked & ~f.masked).any() or (strokes != f.deaf).any():
            f.status[FED] = 0
        f.masked[:], f.deaf[:] = masked, strokes
        f.settled[:] = angles | strokes
        f.apart[f.settled] = 0.0

    def allow_for(self, faults: Sequence[FaultyBoom], lag: float) -> None:
        """State the deviation of the tip by these faults, which neither prediction nor estimate contain.

        `lag` (s) is that of the stamps of what drives the model.
        """
        self.filters.lateness[0] = lag
        self._faults.write_covariance(faults, self.filters.fault)

    def add_phase(self) -> None:
        """Add the phase uncertainty of the vibration at the newest sample after a pause of unknown length.

        Two phases differ by up to twice the amplitude.
        """
        m, n, p = int(self.posture.modes[0]), self.plan.joints, self.posture
        if m == 0:
            return
        _, velocity, acceleration = self._row[self.places.tip].reshape(3, 3)[:, :2]
        amplitude2 = 2.0 * (velocity @ velocity / p.omega[0] ** 2 + acceleration @ acceleration / p.omega[0] ** 4)
        motion2 = float(p.readings[2 + n, n : n + 2] @ p.readings[2 + n, n : n + 2])
        for covariance in self.filters.p:
            covariance[0, 0] += amplitude2 / max(motion2, 1e-300)
            covariance[m, m] += p.omega[0] ** 2 * amplitude2 / max(motion2, 1e-300)

    @property
    def evidence(self) -> float:
        """Log likelihood of all readings since the twin was made, up to a constant of the session."""
        return float(self.filters.evidence[0])

    def take_innovations(self) -> Innovations:
        """Return the innovations since the last call, the first `LOGGED` of each channel."""
        log, counts = self.filters.log.copy(), self.filters.logged.copy()
        self.filters.logged[:] = 0
        return Innovations(log[:, :, 0], log[:, :, 1], counts)

    @property
    def doubts(self) -> int:
        """How often the estimate was doubted because its tip was far off the predicted one."""
        return int(self.filters.status[DOUBTS])

    @property
    def tip_loads(self) -> tuple[Array, Array]:
        """Force at the tip that the model does not know, predicted and estimated (N), and variances, shape (2, 2) each."""
        fast = 2 * int(self.posture.modes[0]) + np.arange(2)
        mean, spread = self.filters.mean, self.filters.spread
        variances = spread[:, fast, fast] + 2.0 * spread[:, fast, fast + 2] + spread[:, fast + 2, fast + 2]
        return mean[:, fast] + mean[:, fast + 2], variances

    @property
    def tip_sigmas(self) -> Array:
        """Standard deviations of the predicted tip along x and y, m, shape (2,)."""
        covariance = np.zeros(6)  # upper triangle for x, y and angle
        write_predicted_covariance(self.posture, self.filters, self.live, covariance)
        return np.asarray(np.sqrt(covariance[[0, 3]]))

    # -- what a prediction has

    @property
    def estimate(self) -> Array:
        """Strokes (m) as predicted at the newest sample, shape (n,)."""
        return self._row[self.places.strokes]

    @property
    def drawn(self) -> Drawn:
        """Return what an outline at the newest sample needs: to be kept, and made `outlines` of with others."""
        return Drawn(self.live.frames.copy(), self._work.position.copy(), self.angles.copy(), self.live.pins.copy())

    def outlines(self, drawn: Sequence[Drawn]) -> list[Outline]:
        """Return centre lines and cylinder pins at several samples, at least one."""
        frames, positions, angles, _ = map(np.array, zip(*drawn, strict=True))
        lines = outline(self.plan, frames, positions), self._undeflected.at(angles)
        return [Outline(shape, undeflected, each.pins) for shape, undeflected, each in zip(*lines, drawn, strict=True)]
