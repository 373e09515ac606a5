"""Health monitor: predictions and measurements in, alarms out. No ROS, no files, no clock."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..config.settings import Settings
from ..deviation.named_faults import FaultyBoom
from ..scene.edit import loaded
from ..scene.schema import Scene
from ..types import NANO, SECOND, SENSORS, Alarm, Array, Channel, Health, Mount, Place, Stream, StrokeReading
from .blocks import BLOCK, Block, BlockBuilder, MeasuredRows
from .deviations import SIGMAS, DeviationMonitor, TipLoadMonitor
from .fault_twins import FaultTwins
from .faults import Fault, explains, hypothesis
from .lag_monitor import LagMonitor
from .sensor_check import NOISE_OVER, Readings, SensorCheck, StreamReadings, sensor_ranges
from .sensor_monitor import SensorMonitor
from .wiring_monitor import WiringMonitor

PERIOD = SECOND  # ns between two `Health` without news
UNCERTAIN = 2.0  # variances of a stroke reading; while a stroke is known worse, sensors are not compared with the prediction
KNOWN = 0.25  # weight of the slow means of an IMU from which on it is used: after 0.6 s, once its wiring is checked
MEASURED_NOISE = (Stream.STROKES, Stream.ANGLES)  # streams whose noise is reported: an IMU's is not told from vibration


class HealthMonitor:
    """Health monitor of one rig.

    Parameters
    ----------
    scene : Scene
        Boom with its load.
    settings : Settings
    mounts : tuple of Mount or None
        Mounts of the angle sensors.
    absent : collection of str
        Channels without a sensor, see `boom_twin.Twin`.
    channels : mapping of Stream to tuple of str
        Channels of every stream.
    reads : StrokeReading
        Quantity that drives the model. Angles that drive it are not compared with the prediction.
    places, declared : mapping of str to Place, to Channel
        See `boom_twin.Twin`.

    Attributes
    ----------
    blocks : BlockBuilder
        Takes predictions and measured samples.
    fault_twins : FaultTwins or None
        Fault twins; None if no causes are named.
    """

    def __init__(
        self,
        scene: Scene,
        settings: Settings,
        mounts: tuple[Mount | None, ...],
        absent: Collection[str],
        channels: Mapping[Stream, tuple[str, ...]],
        reads: StrokeReading,
        places: Mapping[str, Place],
        declared: Mapping[str, Channel],
    ) -> None:
        self._reads, self._drive = reads, reads.stream
        self.fault_twins: FaultTwins | None = None
        self._scene, self._settings = scene, settings
        self._told_faults, self._faulty_booms = list[Alarm](), tuple[FaultyBoom, ...]()
        self._channels = {stream: names for stream, names in channels.items() if names}
        self._ranges = sensor_ranges(scene, mounts)
        self._uncertain = UNCERTAIN * settings.variance(SENSORS[self._drive])
        self._sensors = {
            stream: SensorMonitor(names, stream, stream is not self._drive, absent)
            for stream, names in self._channels.items()
            if stream is not Stream.STROKES or stream is self._drive
        }
        self._measured: list[Stream] = [stream for stream in self._channels if stream is not Stream.STROKES]
        self._imus = [stream for stream in self._channels if SENSORS[stream].is_accelerometer]
        self._lags = LagMonitor(self._drive)
        compared = [stream for stream in SIGMAS if stream is not self._drive]
        self._deviations = {stream: DeviationMonitor(stream, scene, settings) for stream in compared}
        self._wiring = WiringMonitor(scene, reads, mounts, places, declared)
        self._load = TipLoadMonitor(settings.tip_load_limit)
        self._told = 0
        self.begin()

    def begin(self) -> None:
        """Restart with the boom at rest; alarms of sensors last."""
        settings = self._settings
        self.blocks = BlockBuilder()
        fastest = {self._drive: settings.rate(self._reads)}
        self._checks = {
            stream: SensorCheck(*settings.noise(kind), *self._ranges[stream], fastest.get(stream, 0.0))
            for stream, kind in SENSORS.items()
            if stream in self._sensors
        }
        for sensors in self._sensors.values():
            sensors.begin()
        self._lags.begin()
        self._wiring.begin()
        self._load.begin()

    @property
    def suspected(self) -> NDArray[np.bool_]:
        """Return which measured channels, in the order of the streams, the estimate is to leave out.

        These are the channels of failing sensors and streams. An IMU is left out until its mean is known: its noise does not
        show wrong axes.
        """
        unknown = {stream for stream in self._imus if self._checks[stream].slow.weight.max() < KNOWN}
        return np.concatenate(
            [self._masked(stream) | self._wiring.doubted(stream) | (stream in unknown) for stream in self._measured]
        )

    @property
    def failing_strokes(self) -> NDArray[np.bool_]:
        """Return which sensors of those that drive the model give wrong readings or are wired otherwise, shape (n,)."""
        return self._sensors[self._drive].unusable | self._wiring.wrong(self._drive)

    @property
    def wrong_angles(self) -> NDArray[np.bool_]:
        """Return which angle sensors are known to be wrong, shape (n,). One that contradicts its stroke alone is not."""
        stream = Stream.ANGLES
        return self._sensors[stream].masked | self._wiring.found_wrong_angles | self._lags.is_late(stream)

    def _masked(self, stream: Stream) -> NDArray[np.bool_]:
        """Return which channels of a stream are not compared with the prediction."""
        masked = self._sensors[stream].masked | self._wiring.wrong(stream)
        return masked | self._lags.is_late(stream)

    def judge(self, stamp: int, loads: tuple[Array, Array], tip_sigmas: Callable[[], Array]) -> Health | None:
        """Judge the blocks that strokes with `stamp` (ns) complete; return None if there is nothing to report.

        `loads`: predicted and estimated force at the tip that the model does not know, N, and its variances, (2, 2) each.
        `tip_sigmas` returns the standard deviations of the predicted tip, m, (2,); it is called only for a report.
        """
        done = self.blocks.close(stamp)
        news = [alarm for block in done if block.followed for alarm in self._judge(block)]
        if any(alarm.kind == "late" for alarm in (*self._lags.alarms, *self._named)):  # late readings look like forces
            self._load.begin()
        else:
            news += self._load.take(stamp, *loads)
        if done and self.fault_twins is not None:
            news += self.fault_twins.news(done[-1].end)
        if not done or not (news or done[-1].end - self._told >= PERIOD or self._told > done[-1].end):
            return None
        self._told = done[-1].end
        alarms = [*(alarm for alarm in news if alarm.until is not None), *self._lasting()]
        noise = {
            NOISE_OVER + SENSORS[stream].noise: self._checks[stream].noise
            for stream in MEASURED_NOISE
            if stream in self._checks
        }
        return Health(stamp, tuple(alarms), tip_sigmas(), noise)

    @property
    def _named(self) -> list[Alarm]:
        """Alarms of named causes that last."""
        return [] if self.fault_twins is None else self.fault_twins.alarms

    @property
    def drive_lag(self) -> float:
        """Named lag of what drives the model, s; 0 without one."""
        named = (part for each in self._named if each.cause == f"{self._drive.value}.delay" for part in _parts(each))
        return self._lags.lag_of_drive or next((size for _, size, _, _ in named), 0.0)

    @property
    def faulty_booms(self) -> Sequence[FaultyBoom]:
        """Boom with each named fault of stiffnesses and loads; the same object until other faults are named."""
        if (named := self._named) != self._told_faults:
            self._told_faults, self._faulty_booms = named, tuple(self._booms_with(named))
        return self._faulty_booms

    def _booms_with(self, named: Iterable[Alarm]) -> Iterator[FaultyBoom]:
        for alarm in named:
            for kind, size, sigma, _ in _parts(alarm):
                if kind in ("softer", "more", "less"):
                    each = hypothesis(self._scene, [Fault(str(alarm.cause), kind, size)])
                    load = each.load(payload=-1.0, line_fill=-1.0)
                    yield FaultyBoom(loaded(each.scene, **load), sigma / size)

    def _lasting(self) -> Iterable[Alarm]:
        """Yield all alarms that last."""
        for sensors in self._sensors.values():
            yield from (alarm for alarm in sensors.alarms if not self._wiring.explains(alarm))
        yield from self._wiring.alarms
        yield from self._lags.alarms
        yield from () if self._load.alarm is None else (self._load.alarm,)
        for stream, deviations in self._deviations.items():
            yield from (alarm for alarm in deviations.alarms if not any(explains(each, stream, alarm) for each in self._named))
        yield from (each for each in self._named if all(each.cause != late.cause for late in self._lags.alarms))

    def _judge(self, block: Block) -> list[Alarm]:
        """Return the alarms that a block begins or ends."""
        predictions, news = block.predictions(), list[Alarm]()
        is_followed = bool(predictions.variances.max() < self._uncertain)
        span, readings = BLOCK * NANO if is_followed else 0.0, dict[Stream, StreamReadings]()
        for stream in self._measured:
            if stream is not self._drive:
                rows = block.readings(stream)
                readings[stream] = self._checks[stream].summary(rows, self._sensors[stream].masked, span)
        for stream, each in readings.items():
            stamps, raw, left, _ = each.rows
            expected = raw - left if is_followed else np.full(raw.shape, np.nan)
            news += self._check(stream, block, stamps, raw, expected)
        if is_followed and not self._sensors[self._drive].masked.any():
            news += self._compare(block, readings, predictions.measured.mean(axis=0))
        strokes = predictions.measured
        is_shaken = any(each.is_bent for each in readings.values())
        expected = np.full(strokes.shape, np.nan) if is_shaken else np.zeros(strokes.shape)
        return news + self._check(self._drive, block, predictions.stamps, strokes, expected)

    def _compare(self, block: Block, readings: Readings, strokes: Array) -> list[Alarm]:
        """Compare readings with the prediction; `strokes` (n,) are means of the measured ones, m."""
        news = list[Alarm]()
        failing = {stream: sensors.masked for stream, sensors in self._sensors.items()}
        if self._drive is not Stream.ANGLES:
            news += self._wiring.take(block, strokes, readings, failing)
        if self._wiring.has_wrong_strokes:
            return news
        news += self._lags.take(readings, failing, block)
        for stream, deviations in self._deviations.items():
            news += deviations.take(readings[stream], self._masked(stream), block)
        return news

    def _check(self, stream: Stream, block: Block, stamps: NDArray[np.int64], raw: Array, expected: Array) -> list[Alarm]:
        """Check the sensors of a stream one by one: stamps (k,) in ns, raw and expected readings (k, channels)."""
        monitor = self._sensors[stream]
        findings = self._checks[stream].look(np.asarray(stamps * NANO), raw, expected, block.end * NANO)
        if not (findings.flags or monitor.alarms):
            return []
        newest = (raw if stream is self._drive else raw - expected)[-1] if len(raw) else None
        return monitor.take(findings, block.start, block.end, newest)


def _parts(alarm: Alarm) -> Sequence[tuple[str, float, float, str]]:
    """Return kind, size, standard deviation and unit of each part of the most probable cause; see `Ranked`."""
    return alarm.ranked[0].parts if alarm.ranked else ()


def warm_up() -> None:
    """Compile the kernels that judge a rig, on made-up readings of two channels."""
    two = np.zeros((2, 2))
    check = SensorCheck(1.0, 0.0, two[0], two[0], 0.0)
    check.look(np.arange(2.0), two + 100.0, two, 2.0)
    check.summary(MeasuredRows(np.arange(2), two, two, two), np.zeros(2, dtype=bool), 1.0)
