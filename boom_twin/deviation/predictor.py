"""Predict the boom from cylinder lengths, and estimate its tip from all sensors: the filters of `models`, kept by a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.equilibrium import settle, spring_free
from ..analysis.modal import natural_modes
from ..compiler.compile import compile_scene
from ..compiler.plan import first_row, taken_apart
from ..config.settings import Settings
from ..errors import SolverError
from ..estimation.boom_predictor import BoomPredictor
from ..estimation.sensor_model import Mounting
from ..kernels.jit import hold
from ..kernels.tables import OK, SENTENCES
from ..scene.edit import with_rigid_cylinders
from ..scene.kinematics import joint_angles_of_strokes
from ..scene.schema import Scene
from ..scene.summary import weight_of
from ..types import SENSORS, Array, Mount, Prediction, Stream, StrokeReading, channels_of
from .models import FED, FED_STAMP, PREDICTION, Filters, SensorNoise, new_filters, start_models
from .posture import Posture, linearise, new_posture

MODES = 6  # at most
HIGHEST = 25.0  # Hz; what is faster follows load and drives without vibration of its own
WIDTH = 1e-6  # relative accuracy of natural frequencies
USUAL_LOAD, LEAST_LOAD, FIRST_LOAD, BURST_LOAD = 2.5e-3, 1e-4, 2e-3, 2e-2  # shares of the boom's weight, see `SensorNoise`
SWING = 0.3  # of the tip's deflection: how far a boom at work swings


class CompiledLengths(NamedTuple):
    """Fields of a boom as `boom_twin.twin.update_lengths` takes them."""

    tables: Any
    boom: Any
    live: Any
    work: Any
    posture: Posture
    filters: Filters
    bending: Array
    row: Array


class LengthPredictor(BoomPredictor):
    """A boom followed by the lengths of its cylinders.

    Parameters
    ----------
    scene : Scene
        With its load.
    settings : Settings
    mounts : sequence of Mount or None
        Of the angle sensors.
    reads : StrokeReading
        What the stroke transducers read.

    Attributes
    ----------
    posture : Posture
    filters : Filters
    """

    noise = None  # of strokes through the model: the filters' covariance has it

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        mounts: Sequence[Mount | None] = (),
        reads: StrokeReading = StrokeReading.LENGTH,
    ) -> None:
        super().__init__(scene)
        mounting = Mounting(self.plan, scene.base.inclination, mounts)
        n, weight = self.plan.joints, weight_of(scene)
        lengths = np.array([section.length for section in scene.sections])
        self._reads_length = reads is StrokeReading.LENGTH
        self.posture = new_posture(self.plan, MODES, lengths, mounting.frames, mounting.absolute, self._reads_length)
        sizes = (USUAL_LOAD, LEAST_LOAD, FIRST_LOAD, BURST_LOAD)
        used = Stream.STROKES, Stream.ANGLES, Stream.IMU, Stream.FORCES
        variances = (settings.variance(SENSORS[stream]) for stream in used)
        channels = sum(len(names) for stream, names in channels_of(n).items() if stream is not Stream.STROKES)
        self.filters = new_filters(n, MODES, channels, SensorNoise(*variances, *(size * weight for size in sizes)))
        self._struts = compile_scene(with_rigid_cylinders(scene))

    @cached_property
    def held(self) -> tuple[Any, ...]:
        """Fields as compiled code takes them with every call, see `boom_twin.kernels.jit.hold`."""
        boom = self.compiled
        own = boom.tables, boom.anchor, boom.live, boom.work, self.posture, self.filters, boom.bending, boom.row
        return tuple(map(hold, CompiledLengths(*own)))

    @cached_property
    def filters_held(self) -> tuple[Any, ...]:
        """Posture and filters alone, likewise."""
        return hold(self.posture), hold(self.filters)

    def start(self, strokes: Array, speeds: Array | None = None) -> None:
        """Forget all; at rest in equilibrium where transducers read `strokes` (m), shape (n,).

        Parameters
        ----------
        speeds : ndarray, shape (n,), or None
            How fast the cylinders may move already, m/s; None if the boom rests.

        Raises
        ------
        UsageError, SolverError
            Lengths out of reach; no equilibrium there.
        """
        p, f, boom, held = self.posture, self.filters, self._anchor, self._struts.state()
        rigid = joint_angles_of_strokes(self._scene, strokes)
        drives = strokes
        if self._reads_length:
            settle(self._struts, held, self._struts.work(), strokes, rigid)
            forces = taken_apart(self._struts, first_row(self._struts, held)).cylinder_forces
            drives = spring_free(self.plan, strokes, forces)
        settle(self.plan, boom, self._work, drives, rigid)
        p.angles[:] = rigid
        modes = natural_modes(self.plan, boom, self._work, MODES, WIDTH, 2.0 * math.pi * HIGHEST)
        p.modes[0] = len(modes)
        for j, mode in enumerate(modes):
            p.motions[j], p.columns[2 + self.plan.joints + j] = mode.motion, mode.increments
            p.omega[j] = 2.0 * math.pi * mode.frequency
        status = linearise(self.plan.tables, boom, self._work, p, drives, False)
        if status != OK:
            raise SolverError(SENTENCES[int(status)])
        sag = float(np.hypot(*(boom.frames[-1, :2] - self._undeflected.at(rigid)[-1])))
        start_models(p, f, np.zeros_like(drives) if speeds is None else speeds, 0.0 if speeds is None else SWING * sag)

    # -- strokes: what is expected of the lengths

    @property
    def angles(self) -> Array:
        """Joint angles (rad) of the rigid boom at the newest lengths, shape (n,)."""
        return joint_angles_of_strokes(self._scene, self.estimate, near=self.posture.angles)

    def slope(self, joint: int) -> float:
        """Stroke over angle of joint `joint` (0-based), m/rad, by rigid geometry."""
        return 1.0 / float(self.posture.slope[joint])

    @property
    def passes(self) -> int:
        """One: the filters do not iterate."""
        return 1

    @property
    def is_lost(self) -> bool:
        """False: the filters follow any motion of a cylinder."""
        return False

    def extrapolated(self, span: float) -> Array:
        """Lengths (m) `span` s after the newest sample; shape (n,)."""
        x = self.filters.strokes
        return np.asarray(x[:, 0] + span * (x[:, 1] + 0.5 * span * x[:, 2]))

    @property
    def speeds(self) -> Array:
        """Rates of the lengths at the newest sample, as estimated, m/s, shape (n,)."""
        return np.asarray(self.filters.strokes[:, 1])

    def least_way(self, span: float, sure: float) -> float:
        """Return how far (m) the fastest drive goes on for `span` s at least, unless it brakes harder than it now does.

        Speeds and braking are taken `sure` deviations to the safe side.
        """
        n, f = self.plan.joints, self.filters
        first = 2 * int(self.posture.modes[0]) + 4 + n
        mean, deviations = f.mean[PREDICTION], np.sqrt(np.maximum(f.spread[PREDICTION].diagonal(), 0.0))
        rates, accelerations = slice(first, first + n), slice(first + n, first + 2 * n)
        speeds = np.maximum(np.abs(mean[rates]) - sure * deviations[rates], 0.0)
        braking = np.maximum(-mean[accelerations] * np.sign(mean[rates]), 0.0) + sure * deviations[accelerations]
        return float(np.minimum(speeds * span, speeds**2 / (2.0 * np.maximum(braking, 1e-12))).max())

    # -- what a run tells the filters

    def leave_out(self, masked: NDArray[np.bool_], strokes: NDArray[np.bool_]) -> None:
        """Leave masked channels (c,) and strokes (n,) out of the estimate, and forget what a new one of them has told it."""
        f = self.filters
        if (masked & ~f.masked).any() or (strokes != f.deaf).any():
            f.status[FED] = 0
        f.masked[:], f.deaf[:] = masked, strokes

    def rebase(self, shift: int) -> None:
        """All stamps are later by `shift` (ns) from now on."""
        self.filters.status[FED_STAMP] += shift

    def add_phase(self, prediction: Prediction) -> None:
        """The time that passed is not known: two phases of the vibration in `prediction` are twice its amplitude apart."""
        m, n, p = int(self.posture.modes[0]), self.plan.joints, self.posture
        if m == 0:
            return
        velocity, acceleration = prediction.tip_velocity, prediction.tip_acceleration
        amplitude2 = 2.0 * (velocity @ velocity / p.omega[0] ** 2 + acceleration @ acceleration / p.omega[0] ** 4)
        motion2 = float(p.readings[2 + n, n : n + 2] @ p.readings[2 + n, n : n + 2])
        for covariance in self.filters.p:
            covariance[0, 0] += amplitude2 / max(motion2, 1e-300)
            covariance[m, m] += p.omega[0] ** 2 * amplitude2 / max(motion2, 1e-300)

    @property
    def evidence(self) -> float:
        """Logarithm of the likelihood of all that was read since the twin was made, up to a constant of the session."""
        return float(self.filters.evidence[0])

    @property
    def tip_sigmas(self) -> Array:
        """Standard deviations of the predicted tip along x and y, m, shape (2,)."""
        n, m = self.plan.joints, int(self.posture.modes[0])
        rows = np.zeros((2, 2 * m + 4 + 3 * n))
        columns = self.posture.readings[: 2 + n + m, n : n + 2].T
        rows[:, :m], rows[:, 2 * m : 2 * m + 2] = columns[:, 2 + n :], columns[:, :2]
        rows[:, 2 * m + 2 : 2 * m + 4], rows[:, 2 * m + 4 : 2 * m + 4 + n] = columns[:, :2], columns[:, 2 : 2 + n]
        spread = self.filters.spread[PREDICTION, : rows.shape[1], : rows.shape[1]]
        return np.asarray(np.sqrt(np.einsum("ai,ij,aj->a", rows, spread, rows)))
