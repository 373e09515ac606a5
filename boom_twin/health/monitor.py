"""Health monitor: predictions and measurements in, alarms out. No ROS, no files, no clock."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..analysis.modal import StrokeNoise
from ..config.settings import Settings
from ..scene.schema import Scene
from ..types import NANO, Alarm, Array, Health, Mount, Prediction, Residuals, Stream, channels_of
from .baseline import Baseline
from .inference.block_problem import BLOCK, Block, BlockBuilder, BlockMeans, BlockProblem, means, stacked
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

    def predicted(
        self, prediction: Prediction, strokes: Array, variances: Array, noise: StrokeNoise | None, tip: Array
    ) -> None:
        """A prediction, with the strokes (m) as measured, the variances (m^2) of their estimates, the modes there.

        And with the deviation (m) of the tip (2,) that a start from rest leaves.
        """
        self._blocks.predicted(prediction, strokes)
        self._variances, self._noise, self._tip = variances, noise, tip

    def measured(self, residuals: Residuals, values: Array) -> None:
        """Residuals of a sample with its values (rad, m/s^2)."""
        self._blocks.measured(residuals, values)

    def judge(self, stamp: int) -> Health | None:
        """Judge what is complete now that strokes came with `stamp` (ns); None if there is nothing to tell."""
        news: list[Alarm] = []
        done = self._blocks.close(stamp)
        for block in done:
            if block.predictions:
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
        n, start = self._n, block.number * BLOCK
        stamps, raw, left = stacked(block.angles, n)
        before = self._angle_watch.masked
        news = self._angle_watch.take(self._angles.look(stamps, raw, raw - left, block.end * NANO), start, block.end)
        if (self._angle_watch.masked & ~before).any():
            self.residuals.forget()
        stroke_stamps = np.array([prediction.stamp for prediction in block.predictions]) * NANO
        readings = np.array(block.strokes)
        strokes = self._strokes.look(stroke_stamps, readings, np.zeros_like(readings), block.end * NANO)
        news += self._stroke_watch.take(strokes, start, block.end)
        if self._stroke_watch.masked.any() or self._noise is None:
            ended = self.residuals.close(start)
            self.residuals.begin()
            return news if ended is None else [*news, ended]
        told = self.residuals.take(self._means(block, left), self._noise)
        return news if told is None else [*news, told]

    def _means(self, block: Block, left: Array) -> BlockMeans:
        settings, predictions = self._settings, block.predictions
        _, _, forces = stacked(block.forces, 2)
        angle, angle_count = means(left, settings.angle_variance**0.5)
        angle[self._angle_watch.masked] = np.nan
        force, force_count = means(forces, settings.imu_sigma)
        first, last = predictions[0], predictions[-1]
        span = (last.stamp - first.stamp) * NANO
        rates = (last.joints - first.joints) / span if span > 0.0 else np.zeros(self._n)
        accelerations = np.array([prediction.tip_acceleration for prediction in predictions])
        return BlockMeans(
            start=block.number * BLOCK,
            left=np.concatenate([angle, force]),
            counts=np.concatenate([angle_count, force_count]),
            strokes=predictions[len(predictions) // 2].strokes,
            variances=self._variances,
            rates=rates,
            shaking=float((accelerations**2).sum(axis=1).mean()),
        )

    def _tip_sigmas(self) -> Array:
        """Of the predicted tip, m: what strokes and parameters may be off by."""
        signature, watch = self.residuals.signature, self.residuals
        if signature is None:
            return np.full(2, np.nan)
        by_parameters = np.einsum("ij,jk,ik->i", signature.tip, watch.covariance, signature.tip) + self._tip**2
        return np.asarray(np.sqrt(by_parameters + signature.tip_by_stroke**2 @ self._variances))
