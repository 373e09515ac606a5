"""Health monitor: predictions and measurements in, alarms out. No ROS, no files, no clock."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..analysis.modal import StrokeNoise
from ..config.settings import Settings
from ..kernels.jit import SameTypes
from ..scene.schema import Scene
from ..types import NANO, SENSORS, Alarm, Array, Health, Mount, Stream, channels_of
from .angle_reading import AngleReading
from .baseline import JUDGED, Baseline, judged_channels
from .delay_monitor import DelayMonitor, delay_cause, normal_equations
from .detection import Detector
from .force_reading import ForceReading
from .imu_mount import KNOWN, ImuMount
from .inference.block_problem import (
    BLOCK,
    Block,
    BlockBuilder,
    BlockMeans,
    BlockProblem,
    MeasuredRows,
    PredictionRows,
    warm_up_blocks,
)
from .inference.evidence_kernels import Faults, fit_faults
from .inference.hypotheses import Evidence, Regression
from .inference.innovation_filter import InnovationFilter, ModalStates
from .inference.normal_distribution import log_normal_below
from .length_residuals import LengthResiduals
from .residual_monitor import ResidualMonitor
from .sensor_check import NOISE_OVER, SensorCheck, sensor_ranges
from .sensor_monitor import SensorMonitor
from .sensor_survey import collect_means, follow_heard
from .stream_readings import PredictionMeans, StreamReadings, StreamSurvey

PERIOD = 1_000_000_000  # ns between two `Health` without news
UNCERTAIN = 2.0
"""Variances of a reading; strokes that are known worse are not followed, and then sensors are not judged by residuals."""
MEASURED_NOISE = (Stream.STROKES, Stream.ANGLES)
"""Those whose noise is told: what an IMU reads of vibration is not told from noise."""
DELAYED = {Stream.ANGLES: 0.1, Stream.IMU: 0.0, Stream.FORCES: 0.0}
"""Those whose lag `DelayMonitor` tells, and from how many s on: a small one of the angles is among the causes of residuals."""


class HealthMonitor:
    """Follows one rig.

    Parameters
    ----------
    scene : Scene
        With its load.
    settings : Settings
    mounts : tuple of Mount or None
        Of the angle sensors.
    baseline : Baseline
        What is known of this rig while all is well.
    on_block : callable, optional
        Is told every linear problem.
    absent : collection of str
        Channels without a sensor, see `boom_twin.Twin`.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        mounts: tuple[Mount | None, ...],
        baseline: Baseline,
        on_block: Callable[[BlockProblem], object] | None = None,
        absent: Collection[str] = (),
    ) -> None:
        self._settings, self._channels = settings, channels_of(len(scene.joints))
        self.names = judged_channels(len(scene.joints))
        self.residuals = ResidualMonitor(scene, settings, mounts, baseline, self.names, on_block)
        self._ranges = sensor_ranges(scene, mounts)
        self._uncertain = UNCERTAIN * settings.stroke_variance
        self._stated = {stream: settings.variance(kind) for stream, kind in SENSORS.items()}
        self._sensors = {
            stream: SensorMonitor(names, SENSORS[stream], stream is not Stream.STROKES, absent)
            for stream, names in self._channels.items()
        }
        self._delays = {stream: DelayMonitor(stream, least) for stream, least in DELAYED.items()}
        self._mount, self._forces = ImuMount(), ForceReading(self._channels[Stream.FORCES])
        lengths = np.array([section.length for section in scene.sections])
        self._lengths = LengthResiduals(self._channels[Stream.ANGLES], lengths)
        self._angles = AngleReading(scene, mounts)
        self._ended: list[Alarm] = []
        self._told = 0
        self._collect_means = SameTypes(collect_means)
        self.begin()

    def begin(self) -> None:
        """The boom starts from rest; alarms of sensors go on."""
        settings = self._settings
        self._blocks = BlockBuilder()
        fastest = {Stream.STROKES: settings.stroke_rate}
        self._checks = {
            stream: SensorCheck(*settings.noise(kind), *self._ranges[stream], fastest.get(stream, 0.0))
            for stream, kind in SENSORS.items()
        }
        for sensors in self._sensors.values():
            sensors.begin()
        self._ended += self.residuals.close(self._told)
        self._surveys: dict[Stream, StreamSurvey] = {
            stream: StreamSurvey(self._stated[stream], len(names))
            for stream, names in self._channels.items()
            if stream is not Stream.STROKES
        }
        self.residuals.begin()
        for monitor in self._delays.values():
            monitor.begin()
        self._forces.begin()
        self._angles.begin()

    def predicted(self, followed: PredictionRows) -> None:
        """Predictions, at least one."""
        self._blocks.predicted(followed)

    def measured(self, stream: Stream, compared: MeasuredRows) -> None:
        """Samples of one stream with their residuals, at least one."""
        self._blocks.measured(stream, compared)

    @property
    def noise(self) -> tuple[float, float]:
        """Times the noise that is stated, of the strokes and of the angle sensors, as it is with most of them now."""
        return self._checks[Stream.STROKES].noise_now, self._checks[Stream.ANGLES].noise_now

    @property
    def suspected(self) -> NDArray[np.bool_]:
        """Return which of all measured channels, in the order of the streams, the estimate is to leave out.

        Those are the channels of sensors and streams that an alarm holds most likely at fault. An IMU is used once its mean
        is known, for no noise tells that its axes are wrong.
        """
        causes = {alarm.ranked[0].cause for alarm in self.residuals.alarms if alarm.ranked}
        found = []
        for stream, names in self._channels.items():
            if stream is Stream.STROKES:
                continue
            is_unknown = stream is Stream.IMU and self._surveys[stream].slow.weight.max() < KNOWN
            is_out = is_unknown or (stream in self._delays and self._delays[stream].alarm is not None)
            is_out |= not causes.isdisjoint((f"{SENSORS[stream].stem}.sensor", delay_cause(stream)))
            found.append(self._masked(stream) | is_out | np.array([f"{name}.sensor" in causes for name in names]))
        return np.concatenate(found)

    @property
    def failing_strokes(self) -> NDArray[np.bool_]:
        """Return which stroke transducers are known to fail, each by itself, shape (n,)."""
        return self._sensors[Stream.STROKES].masked

    def _masked(self, stream: Stream) -> NDArray[np.bool_]:
        """Return which channels of a stream are not judged by residuals."""
        masked = self._sensors[stream].masked
        if stream is Stream.ANGLES:
            return masked | self._angles.masked | (self._delays[stream].alarm is not None)
        if stream is Stream.FORCES and self._forces.alarms:
            return masked | self._forces.masked
        return masked | (stream is Stream.IMU and self._mount.alarm is not None)

    def judge(self, stamp: int, variances: Array, noise: StrokeNoise | None, tip: Callable[[], Array]) -> Health | None:
        """Judge what is complete now that strokes came with `stamp` (ns); None if there is nothing to tell.

        Parameters
        ----------
        variances : ndarray, shape (n,)
            Of the strokes' estimates, m^2.
        noise : StrokeNoise or None
            With the modes at the present posture.
        tip : callable
            Asked, if there is something to tell, for the deviation (m) of the tip, shape (2,), that a start from rest leaves,
            and that the estimate shows.
        """
        self._noise = noise
        news: list[Alarm] = []
        done = self._blocks.close(stamp)
        for block in done:
            if block.followed:
                news += self._judge(block)
        news += self._ended
        self._ended = []
        if not done or not (news or done[-1].end - self._told >= PERIOD or self._told > done[-1].end):
            return None
        self._told = done[-1].end
        alarms = [alarm for alarm in news if alarm.until is not None]
        for monitor in self._sensors.values():
            alarms += [alarm for alarm in monitor.alarms if not self._angles.explains(alarm)]
        alarms += self._angles.alarms
        alarms += [self._mount.alarm] if self._mount.alarm is not None else []
        alarms += self._forces.alarms
        alarms += self._lengths.alarms
        lags = {each.cause: each for each in (monitor.alarm for monitor in self._delays.values()) if each is not None}
        for alarm in self.residuals.alarms:  # which take vibration for a load: the size is the other's
            lag = lags.get(alarm.cause)
            alarms.append(alarm if lag is None else replace(alarm, told=lag.told, ranked=lag.ranked))
        alarms += lags.values()
        measured = {NOISE_OVER + SENSORS[stream].noise: self._checks[stream].noise for stream in MEASURED_NOISE}
        return Health(
            self._told,
            tuple(alarms),
            self.names,
            self.residuals.levels,
            self._tip_sigmas(variances, tip()),
            measured | self.residuals.limits,
        )

    def _judge(self, block: Block) -> list[Alarm]:
        start, predictions, news = block.number * BLOCK, block.predictions(), []
        predicted = PredictionMeans.of(predictions)
        is_followed = predicted.largest < self._uncertain
        readings, span = dict[Stream, StreamReadings](), BLOCK * NANO if is_followed else 0.0
        for stream, survey in self._surveys.items():
            readings[stream] = survey.take(block.readings(stream), self._masked(stream), span)
        is_shaken = any(each.is_bent for each in readings.values())
        for stream, each in readings.items():
            stamps, raw, left = each.rows
            expected = raw - left if is_followed else np.full(raw.shape, np.nan)
            news += self._check(stream, block, stamps, raw, expected)
        if is_followed and not self._sensors[Stream.STROKES].masked.any():
            if not self._sensors[Stream.IMU].masked.any():
                news += self._void(self._mount.take(readings[Stream.IMU], start, block.end), block.end)
            angles = readings[Stream.ANGLES]
            news += self._void(self._angles.take(angles, predicted.strokes, BLOCK * NANO, start, block.end), block.end)
            news += self._forces.take(readings[Stream.FORCES], start, block.end)
            if self._noise is None:
                news += self._lengths.take(angles, self._masked(Stream.ANGLES), start, block.end)
            for stream, monitor in self._delays.items():
                found = self._judge_delay(stream, monitor, block, readings[stream])
                news += self._void(found, block.end) if stream is Stream.ANGLES else found
        strokes = predictions.measured
        expected = np.full(strokes.shape, np.nan) if is_shaken else np.zeros(strokes.shape)
        news += self._check(Stream.STROKES, block, predictions.stamps, strokes, expected)
        if self._sensors[Stream.STROKES].masked.any() or self._angles.has_wrong_strokes or self._noise is None:
            news += self.residuals.close(start)
            self.residuals.begin()
            return news
        averaged = self._means(start, predictions, predicted, readings)
        return news + self.residuals.take(averaged, self._noise)

    def _void(self, news: list[Alarm], end: int) -> list[Alarm]:
        """With news of readings that mean something else: what was suspected by them, or is being collected, is void."""
        if any(alarm.until is None for alarm in news):
            news += self.residuals.close(end)
            self.residuals.begin()
        return news

    def _judge_delay(self, stream: Stream, monitor: DelayMonitor, block: Block, readings: StreamReadings) -> list[Alarm]:
        """Look for a lag of a stream; gives the alarm that began, changed or ended."""
        is_doubted = partial(self._is_doubted, stream, block.end)
        shared = 0.0 if stream is Stream.ANGLES else self._delays[Stream.ANGLES].estimate()[0]
        period = 1.0 / self._noise.modes[0].frequency if self._noise is not None and self._noise.modes else 0.0
        return monitor.take(block.number, readings, self._sensors[stream].masked, block.end, is_doubted, period, shared)

    def _is_doubted(self, stream: Stream, stamp: int) -> bool:
        """Whether a load, or a fault that is not its lag, may put the vibration that a stream reads out of step at `stamp`.

        No vibration puts angles off by what they go in a tenth of a second.
        """
        if stream is Stream.ANGLES:
            return False
        cause = delay_cause(stream)
        suspects = [{each.cause, *(rank.cause for rank in each.ranked)} for each in self.residuals.alarms]
        return self.residuals.is_shaken(stamp) or any(cause not in each for each in suspects)

    def _check(self, stream: Stream, block: Block, stamps: NDArray[np.int64], raw: Array, expected: Array) -> list[Alarm]:
        """Check the sensors of a stream: stamps (k,) in ns, readings and what they should be (k, channels); gives the news."""
        monitor = self._sensors[stream]
        before = monitor.masked
        findings = self._checks[stream].look(np.asarray(stamps * NANO), raw, expected, block.end * NANO)
        if findings.is_calm and not monitor.alarms:
            return []
        blamed = self.residuals.blamed if not findings.is_calm and findings.jumped.any() else {}
        newest = (raw if stream is Stream.STROKES else raw - expected)[-1] if len(raw) else None
        news = monitor.take(findings, block.number * BLOCK, block.end, blamed, newest)
        if stream in JUDGED and monitor.masked is not before and (monitor.masked & ~before).any():
            self.residuals.forget()
        return news

    def _means(
        self, start: int, predictions: PredictionRows, predicted: PredictionMeans, readings: dict[Stream, StreamReadings]
    ) -> BlockMeans:
        """Means of the residuals of every stream that is judged, of the block that begins at `start` (ns)."""
        (left, counts, rates), first, imu = np.empty((3, len(self.names))), 0, readings[Stream.IMU]
        is_felt = len(imu.rows.stamps) > 0
        for stream in JUDGED:
            self._collect_means(readings[stream].numbers, self._masked(stream), first, left, counts, rates)
            first += len(self._channels[stream])
        rates[: len(predicted.rates)] = predicted.rates  # of the joints: those of a prediction are there without readings
        return BlockMeans(
            start=start,
            left=left,
            counts=counts,
            strokes=predictions.strokes[len(predictions.stamps) // 2],
            variances=predicted.variances,
            rates=rates,
            shaking=predicted.shaking,
            motion=(imu if is_felt else readings[Stream.ANGLES]).rows,
            is_felt=is_felt,
        )

    def _tip_sigmas(self, variances: Array, tip: Array) -> Array:
        """Of the predicted tip, m: what strokes with these variances (n,) and parameters may be off by, and `tip` (2,)."""
        signature, watch = self.residuals.signature, self.residuals
        if signature is None:
            return np.full(2, np.nan)
        by_parameters = np.einsum("ij,jk,ik->i", signature.tip, watch.covariance, signature.tip) + tip**2
        return np.asarray(np.sqrt(by_parameters + signature.tip_by_stroke**2 @ variances))


def warm_up() -> None:
    """Compile the kernels that judge a rig, on made-up readings of two channels."""
    none, two = np.zeros((0, 0)), np.zeros((2, 2))
    SensorCheck(1.0, 0.0, two[0], two[0], 0.0).look(np.arange(2.0), two + 100.0, two, 2.0)
    PredictionMeans.of(PredictionRows(np.arange(2), two, two, two, two, two))
    StreamSurvey(1.0, 2).take(MeasuredRows(np.arange(2), two, two), np.zeros(2, dtype=bool), 1.0)
    whitening = InnovationFilter(2, 2, BLOCK * NANO, 0.0)
    whitening.tune(ModalStates(np.zeros(0), none, none, none, none, np.zeros((2, 0)), two[0], np.zeros((0, 2)), two))
    found = whitening.step(np.ones((2, 2)), np.eye(2), two[0], 0.0, 0.0)
    regression = Regression(np.zeros(1), np.eye(1))
    regression.take(found.white, True)
    _ = regression.has_strayed
    Evidence.none(1, (1,)).with_rows(found.white[None], np.zeros(1)).given(np.zeros(1), np.eye(1))
    log_normal_below(two)
    place, one = np.zeros(1, np.int64), np.ones(1)
    faults = Faults(place, one, one > 0.0, one, one, place, place + 1)
    SameTypes(fit_faults)(faults, np.ones((1, 2, 2)), np.ones((1, 2)), 1.0, np.empty((1, 6, 2)))
    warm_up_blocks()
    normal_equations(two[None], two[None], 0.0)
    SameTypes(follow_heard)(two[0], two[0], two[0], 0.0, two[0])
    SameTypes(collect_means)(np.zeros((6, 2)), np.zeros(2, dtype=bool), 0, two[0], two[0], two[0])
    Detector(2, BLOCK * NANO, 1e-6).take(np.zeros(2))
