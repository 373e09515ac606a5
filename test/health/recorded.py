"""The bundled session, synthetic by construction, with faults put on its readings by the test."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from recordings import write_session
from session_readings import rows_in, samples_in

from boom_twin import Report, Sample, Settings, Stream, Twin, load_scene
from boom_twin.health.sensor_check import Block, SensorCheck, SensorFindings
from boom_twin.types import Alarm, Health

NANO = 1e-9
ARCH, PUMP = (Path(__file__).parents[2] / "bags" / name for name in ("arch_session", "pump_session"))


@lru_cache
def session(seconds: float = 12.0, folder: Path = ARCH) -> tuple[Sample, ...]:
    """Its samples."""
    return tuple(samples_in(folder, seconds=seconds))


def written(folder: Path, seconds: float) -> int:
    """Write them as a session with the scene of the bundled one; the number of its stroke samples."""
    rows = rows_in(ARCH, seconds)
    write_session(folder, *rows, {"origin": "synthetic, the beginning of the bundled session"})
    shutil.copy(ARCH / "session.yaml", folder)
    return len(rows[0])


class Outcome(NamedTuple):
    """What a twin told of a session; times in s since its first sample."""

    twin: Twin
    reports: list[Report]
    health: list[Health]
    start: int

    def states(self) -> list[tuple[float, Alarm]]:
        """Every alarm at every stamp at which it was told."""
        return [((health.stamp - self.start) * NANO, alarm) for health in self.health for alarm in health.alarms]

    def told(self) -> list[tuple[float, str, str, str | None]]:
        """Channel, kind and cause of every alarm when it was first told so."""
        found: dict[tuple[str, int, str, str | None], float] = {}
        for time, alarm in self.states():
            found.setdefault((alarm.channel, alarm.since, alarm.kind, alarm.cause), time)
        return [(time, channel, kind, cause) for (channel, _, kind, cause), time in found.items()]

    def causes(self) -> set[str]:
        """Everything that was ever named."""
        return {alarm.cause for _, alarm in self.states() if alarm.cause is not None}

    def tips(self) -> np.ndarray:
        """Predicted tips, shape (k, 2)."""
        return np.array([report.prediction.tip_position for report in self.reports if report.prediction is not None])


def run(samples: Iterable[Sample], settings: Settings | None = None, twin=None) -> Outcome:
    """A twin of the default boom takes them all."""
    samples = list(samples)
    twin = twin or Twin(load_scene(), settings, health=True)
    reports = [twin.update(sample) for sample in samples]
    return Outcome(twin, reports, [r.health for r in reports if r.health is not None], samples[0].stamp)


def look(check: SensorCheck, number: int, times: np.ndarray, raw: np.ndarray, expected=0.0) -> SensorFindings:
    """A check takes the block of this number, with readings (k, channels) at `times` (s)."""
    stamps = np.round(times / NANO).astype(np.int64)
    check.collect(np.arange(len(stamps)), stamps, raw, raw - expected, np.ones_like(raw))
    return check.take(Block(number), np.zeros(raw.shape[1], dtype=bool))


def spoilt(samples, stream: Stream, channel: int, change, onset: float = 6.0) -> list[Sample]:
    """`change` (value, s since the onset) on one channel from the onset (s) on."""
    start, found = samples[0].stamp, []
    for sample in samples:
        time = (sample.stamp - start) * NANO - onset
        if sample.stream is stream and time >= 0.0:
            values = sample.values.copy()
            values[channel] = change(values[channel], time)
            sample = Sample(stream, sample.stamp, values)
        found.append(sample)
    return found
