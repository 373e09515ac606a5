"""Health monitor: predictions and measurements in, alarms out. No ROS, no files, no clock."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..config.settings import Settings
from ..deviation.named_faults import FaultyBoom
from ..scene.edit import loaded
from ..scene.schema import Scene
from ..types import SECOND, SENSORS, Alarm, Array, Channel, Health, Integers, Mount, Place, Stream, StrokeReading
from .deviations import SIGMAS, DeviationMonitor, TipLoadMonitor
from .fault_twins import FaultTwins
from .faults import Fault, explains, hypothesis
from .lag_monitor import LagMonitor
from .sensor_check import BLOCK, NOISE_OVER, Block, SensorCheck, SensorFindings, sensor_ranges
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
    checks : mapping of Stream to SensorCheck
        These collect the readings, see `collect`.
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
        self._uncertain = math.sqrt(UNCERTAIN * settings.variance(SENSORS[self._drive]))
        self._sensors = {
            stream: SensorMonitor(names, stream, stream is not self._drive, absent)
            for stream, names in self._channels.items()
            if stream is not Stream.STROKES or stream is self._drive
        }
        self._measured: list[Stream] = [stream for stream in self._channels if stream is not Stream.STROKES]
        self._compared = [stream for stream in self._measured if stream is not self._drive]
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
        settings, self._closed = self._settings, 0  # ns up to which blocks are judged
        fastest = {self._drive: settings.rate(self._reads)}
        self.checks = {
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
        unknown = {stream for stream in self._imus if self.checks[stream].slow.weight.max() < KNOWN}
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
        news, closed, drive = list[Alarm](), (stamp // BLOCK - 1) * BLOCK, self.checks[self._drive]
        if is_done := drive.first_kept < closed:
            self._closed = closed
        while drive.first_kept < closed:
            news += self._judge(Block(int(drive.first_kept) // BLOCK))
        if any(alarm.kind == "late" for alarm in (*self._lags.alarms, *self._named)):  # late readings look like forces
            self._load.begin()
        else:
            news += self._load.take(stamp, *loads)
        if is_done and self.fault_twins is not None:
            news += self.fault_twins.news(closed)
        if not is_done or not (news or closed - self._told >= PERIOD or self._told > closed):
            return None
        self._told = closed
        alarms = [*(alarm for alarm in news if alarm.until is not None), *self._lasting()]
        noise = {
            NOISE_OVER + SENSORS[stream].noise: self.checks[stream].noise for stream in MEASURED_NOISE if stream in self.checks
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

    def collect(self, stream: Stream, rows: Integers, stamps: Integers, raw: Array, left: Array, sigmas: Array) -> None:
        """Keep readings of a stream for the blocks that are still open, see `SensorCheck.collect`."""
        self.checks[stream].collect(rows, stamps, raw, left, sigmas, self._closed)

    def _judge(self, block: Block) -> list[Alarm]:
        """Return the alarms that a block begins or ends."""
        drive, news = self.checks[self._drive], list[Alarm]()
        is_followed = drive.largest_sigma(block.end) < self._uncertain
        for stream in self._compared:
            findings = self.checks[stream].take(block, self._sensors[stream].masked, is_followed)
            news += self._told_by(stream, findings, block)
        is_shaken = any(self.checks[stream].is_bent for stream in self._compared)
        findings = drive.take(block, self._sensors[self._drive].masked, not is_shaken)
        if is_followed and not self._sensors[self._drive].masked.any():
            news += self._compare(block)
        return news + self._told_by(self._drive, findings, block)

    def _compare(self, block: Block) -> list[Alarm]:
        """Compare readings with the prediction."""
        news, checks = list[Alarm](), {stream: self.checks[stream] for stream in self._compared}
        failing = {stream: sensors.masked for stream, sensors in self._sensors.items()}
        if self._drive is not Stream.ANGLES:
            news += self._wiring.take(block, self.checks, failing)
        if self._wiring.has_wrong_strokes:
            return news
        news += self._lags.take(checks, failing, block)
        for stream, deviations in self._deviations.items():
            news += deviations.take(checks[stream], self._masked(stream), block)
        return news

    def _told_by(self, stream: Stream, findings: SensorFindings, block: Block) -> list[Alarm]:
        """Return the alarms of single sensors of a stream that its findings begin or end."""
        monitor, check = self._sensors[stream], self.checks[stream]
        if not (findings.flags or monitor.alarms):
            return []
        newest = check.newest[0 if stream is self._drive else 1] if check.has_readings else None
        return monitor.take(findings, block.start, block.end, newest)


def _parts(alarm: Alarm) -> Sequence[tuple[str, float, float, str]]:
    """Return kind, size, standard deviation and unit of each part of the most probable cause; see `Ranked`."""
    return alarm.ranked[0].parts if alarm.ranked else ()


def warm_up() -> None:
    """Compile the kernels that judge a rig, on made-up readings of two channels."""
    two = np.zeros((2, 2))
    check = SensorCheck(1.0, 0.0, two[0], two[0], 0.0)
    check.collect(np.arange(2), np.arange(2), two + 100.0, two, two)
    check.take(Block(0), np.zeros(2, dtype=bool))
