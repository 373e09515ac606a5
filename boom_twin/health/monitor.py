"""Health monitor: predictions and measurements in, alarms out. No ROS, no files, no clock."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..analysis.modal import StrokeNoise
from ..config.settings import Settings
from ..scene.schema import Scene
from ..types import NANO, Alarm, Array, Health, Mount, Stream, channels_of
from .baseline import Baseline
from .inference.block_problem import BLOCK, Block, BlockBuilder, BlockMeans, BlockProblem, Compared, Followed, means
from .residual_monitor import ResidualMonitor
from .sensor_monitor import SensorCheck, SensorMonitor

PERIOD = 1_000_000_000  # ns between two `Health` without news


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
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        mounts: tuple[Mount | None, ...],
        baseline: Baseline,
        on_block: Callable[[BlockProblem], object] | None = None,
    ) -> None:
        n = len(scene.joints)
        self._n, self._settings = n, settings
        channels = channels_of(n)
        self.names = (*channels[Stream.ANGLES], *channels[Stream.IMU])
        self._low = np.array([np.radians(joint.range_deg[0]) for joint in scene.joints])
        self._high = np.array([np.radians(joint.range_deg[1]) for joint in scene.joints])
        absolute = np.array([mount is not None for mount in mounts])
        self._low[absolute], self._high[absolute] = -np.inf, np.inf
        self._travel = np.array([joint.cylinder.max_stroke for joint in scene.joints])
        self.residuals = ResidualMonitor(scene, settings, mounts, baseline, self.names, on_block)
        self._angle_watch = SensorMonitor(channels[Stream.ANGLES], "rad")
        self._stroke_watch = SensorMonitor(channels[Stream.STROKES], "m")
        self._ended: list[Alarm] = []
        self._told = 0
        self.begin()

    def begin(self) -> None:
        """The boom starts from rest; alarms of sensors go on."""
        settings = self._settings
        self._blocks = BlockBuilder()
        self._angles = SensorCheck(settings.angle_sigma, settings.angle_resolution, self._low, self._high, 0.0)
        zero = np.zeros(self._n)
        self._strokes = SensorCheck(settings.stroke_sigma, settings.stroke_resolution, zero, self._travel, settings.stroke_rate)
        ended = self.residuals.close(self._told)
        if ended is not None:
            self._ended.append(ended)
        self.residuals.begin()

    def predicted(self, followed: Followed) -> None:
        """Predictions, at least one."""
        self._blocks.predicted(followed)

    def measured(self, stream: Stream, compared: Compared) -> None:
        """Samples of one stream with their residuals, at least one; only angles and IMU matter."""
        if stream in (Stream.ANGLES, Stream.IMU):
            self._blocks.measured(stream, compared)

    def judge(self, stamp: int, variances: Array, noise: StrokeNoise | None, tip: Array) -> Health | None:
        """Judge what is complete now that strokes came with `stamp` (ns); None if there is nothing to tell.

        Parameters
        ----------
        variances : ndarray, shape (n,)
            Of the strokes' estimates, m^2.
        noise : StrokeNoise or None
            With the modes at the present posture.
        tip : ndarray, shape (2,)
            Deviation (m) of the tip that a start from rest leaves.
        """
        self._variances, self._noise, self._tip = variances, noise, tip
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
        lasting = (*self._stroke_watch.alarms, *self._angle_watch.alarms)
        if self.residuals.alarm is not None:
            lasting = (*lasting, self.residuals.alarm)
        ended = tuple(alarm for alarm in news if alarm.until is not None)
        return Health(self._told, (*ended, *lasting), self.names, self.residuals.levels, self._tip_sigmas())

    def _judge(self, block: Block) -> list[Alarm]:
        start, predictions = block.number * BLOCK, block.predictions()
        stamps, raw, left = block.readings(Stream.ANGLES, self._n)
        times, stroke_times = np.asarray(stamps * NANO, float), np.asarray(predictions.stamps * NANO, float)
        before = self._angle_watch.masked
        news = self._angle_watch.take(self._angles.look(times, raw, raw - left, block.end * NANO), start, block.end)
        if (self._angle_watch.masked & ~before).any():
            self.residuals.forget()
        readings = predictions.measured
        strokes = self._strokes.look(stroke_times, readings, np.zeros_like(readings), block.end * NANO)
        news += self._stroke_watch.take(strokes, start, block.end)
        if self._stroke_watch.masked.any() or self._noise is None:
            ended = self.residuals.close(start)
            self.residuals.begin()
            return news if ended is None else [*news, ended]
        told = self.residuals.take(self._means(block, predictions, left), self._noise)
        return news if told is None else [*news, told]

    def _means(self, block: Block, predictions: Followed, left: Array) -> BlockMeans:
        settings, stamps = self._settings, predictions.stamps
        angle, angle_count = means(left, settings.angle_variance**0.5)
        angle[self._angle_watch.masked] = np.nan
        force, force_count = means(block.readings(Stream.IMU, 2).left, settings.imu_sigma)
        span = int(stamps[-1] - stamps[0]) * NANO
        rates = (predictions.joints[-1] - predictions.joints[0]) / span if span > 0.0 else np.zeros(self._n)
        return BlockMeans(
            start=block.number * BLOCK,
            left=np.concatenate([angle, force]),
            counts=np.concatenate([angle_count, force_count]),
            strokes=predictions.strokes[len(stamps) // 2],
            variances=self._variances,
            rates=rates,
            shaking=float((predictions.accelerations**2).sum(axis=1).mean()),
        )

    def _tip_sigmas(self) -> Array:
        """Of the predicted tip, m: what strokes and parameters may be off by."""
        signature, watch = self.residuals.signature, self.residuals
        if signature is None:
            return np.full(2, np.nan)
        by_parameters = np.einsum("ij,jk,ik->i", signature.tip, watch.covariance, signature.tip) + self._tip**2
        return np.asarray(np.sqrt(by_parameters + signature.tip_by_stroke**2 @ self._variances))
