"""The twin: samples of the rig in, predictions and residuals out. No ROS, no files, no clock."""

from __future__ import annotations

import math
from collections import Counter, deque

import numpy as np

from .analysis.noise import StrokeNoise, stroke_noise
from .analysis.statics import outline, settle
from .chain.newton import OK
from .chain.status import SENTENCES
from .errors import BoomTwinError
from .estimate.follower import Tuning, begin, copy_state, follow, new_track
from .plan.compile import compile_scene
from .records import Array, Prediction, Report, Residuals, Sample, Stream
from .scene.kinematics import joint_angles_of_strokes, linkage
from .scene.parts import Scene
from .settings import Settings
from .physics.linkage import cylinder_length

EVENTS = {
    "late": "stamp not after the newest one of its stream; sample left out",
    "duplicate": "stamp as the newest one of its stream; sample left out",
    "partial": "some values missing or not finite; the others were used",
    "empty": "no usable value; sample left out",
    "waiting": "not all strokes known yet; the model has not started",
    "gap": "longer pause between strokes, bridged",
    "restart": "pause too long to bridge; started again from rest",
    "jump back": "time was set back; everything started again",
    "model": "the model failed; it starts again with the next full sample",
    "unmatched": "no prediction at the stamp of this sample; no residual",
}

NANO = 1e-9
MEMORY = 2_000_000_000  # ns of predictions kept for samples that come late
PENDING = 4096  # most samples that wait for a stroke
SHAPE_PERIOD = 50_000_000  # ns of one slot; one shape is given in each, 20 a second
POSTURE_STEP = 0.04  # m of stroke after which the noise is propagated anew
NOISE_INTERVAL = 250_000_000  # ns between looks at whether it has, and evaluations of how the noise has grown
SMOOTH_INTERVAL = 0.1  # weight of a new sample interval in the running mean


class Twin:
    """Follows a boom's strokes sample by sample.

    Parameters
    ----------
    scene : Scene
        The boom.
    settings : Settings, optional
        Noise of the sensors, tuning of the estimator, limits on time.

    Notes
    -----
    Everything predicted is a function of the accepted stroke samples alone; angle and IMU samples only give residuals, each
    against the prediction interpolated at its own stamp, in whatever order samples arrive.
    """

    def __init__(self, scene: Scene, settings: Settings | None = None) -> None:
        self.scene, self.settings = scene, settings or Settings()
        self.plan = compile_scene(scene)
        self.counts: Counter[str] = Counter()
        tuned = self.settings
        self._tuning = Tuning(
            tuned.stroke_variance, tuned.jerk_density, tuned.lag, tuned.step, tuned.look_step, tuned.rho
        )
        lengths = np.array([section.length for section in scene.sections])
        self._anchor, self._live, self._work = self.plan.state(), self.plan.state(), self.plan.work()
        self._track = new_track(self.plan, lengths)
        self._row = np.zeros(4 * self.plan.joints + 11)
        self._names = tuple(f"joint_{i + 1}" for i in range(self.plan.joints))
        gx, gy = self.plan.tables.gravity
        self._gravity = np.array([gx, gy])
        self._clear()

    def reset(self) -> None:
        """Forget everything but the counts; the next full stroke sample starts from static equilibrium."""
        self._clear()

    def warm_up(self) -> None:
        """Compile every kernel, with a boom of the same kind that is thrown away."""
        other = Twin(self.scene, self.settings)
        middle = np.array([0.5 * math.radians(sum(joint.range_deg)) for joint in self.scene.joints])
        strokes = np.array(
            [
                cylinder_length(linkage(self.scene, i), angle)[0] - self.scene.joints[i].cylinder.closed_length
                for i, angle in enumerate(middle)
            ]
        )
        for k in range(20):
            other.update(Sample(Stream.STROKES, k * 5_000_000, strokes))
        other.update(Sample(Stream.ANGLES, 0, middle))

    def update(self, sample: Sample) -> Report:
        """Take one sample; see `Report` for what comes back. Never raises on what a sample holds."""
        complete = math.isfinite(sample.values.sum())
        if not complete and not np.isfinite(sample.values).any():
            return self._refuse(sample, "empty")
        if sample.stream is Stream.STROKES:
            return self._take_strokes(sample, complete)
        return self._take_measured(sample, complete)

    # -- strokes ----------------------------------------------------------------------------------------------------

    def _take_strokes(self, sample: Sample, complete: bool) -> Report:
        events: list[str] = []
        if self._newest is not None:
            span = (sample.stamp - self._newest) * NANO
            if -self.settings.jump_back <= span <= 0.0:
                return self._refuse(sample, "duplicate" if span == 0.0 else "late")
            if span < 0.0 or span > self.settings.restart_gap:
                events.append("jump back" if span < 0.0 else "restart")
                self._clear()
            elif span > self.settings.gap:
                events.append("gap")
        if not complete:
            events.append("partial")
        if self._newest is None:
            return self._start(sample, events) if complete else self._refuse(sample, "waiting", *events)
        return self._step(sample, events)

    def _start(self, sample: Sample, events: list[str]) -> Report:
        try:
            angles = joint_angles_of_strokes(self.scene, sample.values)
            settle(self.plan, self._anchor, self._work, sample.values, angles)
        except BoomTwinError as error:
            return self._refuse(sample, "model", *events, status=str(error))
        self._track.angles[:] = angles
        self._epoch = sample.stamp
        status = begin(
            self.plan.tables, self._anchor, self._live, self._work, self._track, self._tuning, sample.values, self._row
        )
        return self._finish(sample, events, status)

    def _step(self, sample: Sample, events: list[str]) -> Report:
        assert self._newest is not None and self._epoch is not None
        span = (sample.stamp - self._newest) * NANO
        if span > 0.0:
            self._interval += SMOOTH_INTERVAL * (span - self._interval) if self._interval else span
        time = (sample.stamp - self._epoch) * NANO
        status = follow(
            self.plan.tables, self._anchor, self._live, self._work, self._track, self._tuning, time, sample.values, self._row
        )
        return self._finish(sample, events, status)

    def _finish(self, sample: Sample, events: list[str], status: int) -> Report:
        if status != OK:
            self._clear()
            return self._refuse(sample, "model", *events, status=SENTENCES[status])
        self._newest = sample.stamp
        prediction = self._prediction(sample.stamp)
        self._remember(prediction, self._row[3 * self.plan.joints + 9 : 4 * self.plan.joints + 9])
        self.counts.update(events)
        return Report(sample.stamp, True, prediction, self._settle_pending(), tuple(events))

    def _prediction(self, stamp: int) -> Prediction:
        n, row = self.plan.joints, self._row.copy()
        tip = row[2 * n : 2 * n + 9]
        return Prediction(
            stamp=stamp,
            tip_position=tip[0:2],
            tip_displacement=tip[0:2] - row[4 * n + 9 :],
            tip_velocity=tip[3:5],
            tip_acceleration=tip[6:8],
            tip_angle=float(tip[2]),
            tip_angular_velocity=float(tip[5]),
            tip_angular_acceleration=float(tip[8]),
            joints=row[:n],
            strokes=row[2 * n + 9 : 3 * n + 9],
            cylinder_forces=row[n : 2 * n],
            shape=self._shape(stamp),
        )

    def _shape(self, stamp: int) -> Array | None:
        """The centre line at the first stamp of its slot of time: a rule of the stamps only, indifferent to jitter."""
        before, self._slot = self._slot, stamp // SHAPE_PERIOD
        return outline(self.plan, self._live, self._work.position) if self._slot != before else None

    # -- measured angles and accelerations ----------------------------------------------------------------------------

    def _take_measured(self, sample: Sample, complete: bool) -> Report:
        newest = self._newest_measured.get(sample.stream)
        if newest is not None and newest - self.settings.jump_back / NANO <= sample.stamp <= newest:
            return self._refuse(sample, "duplicate" if sample.stamp == newest else "late")
        self._newest_measured[sample.stream] = sample.stamp
        events = () if complete else ("partial",)
        self.counts.update(events)
        if self._newest is None or sample.stamp > self._newest:
            if len(self._pending) == PENDING:
                self._pending.popleft()
                self.counts["unmatched"] += 1
            self._pending.append(sample)
            return Report(sample.stamp, True, events=events)
        residuals = self._residuals(sample)
        if residuals is None:
            return self._refuse(sample, "unmatched", *events)
        return Report(sample.stamp, True, residuals=(residuals,), events=events)

    def _settle_pending(self) -> tuple[Residuals, ...]:
        """Residuals of all samples that waited for the newest stroke."""
        if not self._pending:
            return ()
        assert self._newest is not None
        ready = sorted((s for s in self._pending if s.stamp <= self._newest), key=lambda s: (s.stamp, s.stream.value))
        self._pending = deque(s for s in self._pending if s.stamp > self._newest)
        found = [self._residuals(sample) for sample in ready]
        self.counts["unmatched"] += found.count(None)
        return tuple(residuals for residuals in found if residuals is not None)

    def _residuals(self, sample: Sample) -> Residuals | None:
        expected = self._expected(sample.stamp)
        if expected is None:
            return None
        joints, force, sigmas, force_sigmas = expected
        if sample.stream is Stream.ANGLES:
            return Residuals(sample.stream, sample.stamp, self._names, sample.values - joints, sigmas)
        return Residuals(sample.stream, sample.stamp, ("tip_imu_x", "tip_imu_z"), sample.values - force, force_sigmas)

    def _remember(self, prediction: Prediction, variances: Array) -> None:
        """Keep what residuals need: joint angles, specific force at the tip, and the deviations to expect."""
        c, s = math.cos(prediction.tip_angle), math.sin(prediction.tip_angle)
        ax, ay = prediction.tip_acceleration - self._gravity
        force = np.array([c * ax + s * ay, c * ay - s * ax])
        self._refresh_noise(prediction)
        sigmas = np.sqrt(self._quiet[0] + self._slopes2 * variances)
        self._past.append((prediction.stamp, prediction.joints, force, sigmas, self._quiet[1]))
        while self._past[0][0] < prediction.stamp - MEMORY:
            self._past.popleft()

    def _expected(self, stamp: int) -> tuple[Array, Array, Array, Array] | None:
        """Joints, specific force and their deviations at `stamp`, linear between the two predictions around it."""
        after = None
        for entry in reversed(self._past):
            if entry[0] == stamp:
                return entry[1:]
            if entry[0] < stamp:
                if after is None:
                    return None
                share = (stamp - entry[0]) / (after[0] - entry[0])
                joints = entry[1] + share * (after[1] - entry[1])
                return joints, entry[2] + share * (after[2] - entry[2]), after[3], after[4]
            after = entry
        return None

    # -- expected deviations ------------------------------------------------------------------------------------------

    def _refresh_noise(self, prediction: Prediction) -> None:
        """Propagate stroke noise anew when the posture has changed, and let it grow with time."""
        assert self._epoch is not None
        if self._noise is not None and prediction.stamp < self._noise_stamp + NOISE_INTERVAL:
            return
        if self._noise is None or float(np.max(np.abs(prediction.strokes - self._noise_at))) > POSTURE_STEP:
            self._propagate(prediction)
        assert self._noise is not None
        self._noise_stamp = prediction.stamp
        time = (prediction.stamp - self._epoch) * NANO
        joints, acceleration = self._noise.after(time, prediction.tip_angle)
        self._quiet = (self.settings.angle_variance + joints, np.sqrt(self.settings.imu_sigma**2 + acceleration))

    def _propagate(self, prediction: Prediction) -> None:
        tuned = self.settings
        interval = self._interval or tuned.step
        copy_state(self._live, self._probe)
        position = self._work.position.copy()
        self._noise = stroke_noise(
            self.plan, self._probe, self._work, tuned.stroke_variance, interval, tuned.jerk_density
        )
        self._work.position[:] = position
        self._noise_at = prediction.strokes
        slopes = [cylinder_length(self.plan.tables.linkages[i], a)[1] for i, a in enumerate(self._track.angles)]
        self._slopes2 = 1.0 / np.square(slopes)

    # -- bookkeeping --------------------------------------------------------------------------------------------------

    def _clear(self) -> None:
        self._newest: int | None = None
        self._slot: int | None = None
        self._epoch: int | None = None
        self._interval = 0.0
        self._newest_measured: dict[Stream, int] = {}
        self._pending: deque[Sample] = deque()
        self._past: deque[tuple[int, Array, Array, Array, Array]] = deque()
        self._noise: StrokeNoise | None = None
        self._noise_at = np.zeros(self.plan.joints)
        self._noise_stamp = 0
        self._probe = self.plan.state()

    def _refuse(self, sample: Sample, *events: str, status: str = "ok") -> Report:
        self.counts.update(events)
        return Report(sample.stamp, False, events=events, status=status)
