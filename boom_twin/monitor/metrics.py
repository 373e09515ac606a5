"""Metrics at ``/metrics`` for Prometheus."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily

from ..twin.blocks import EVENTS
from ..types import SENSORS, Array
from .data.feed import Feed
from .data.status import LEVELS, SILENCE, StatusLamp
from .data.store import EVERY_STROKE, Table
from .data.topic_rows import COMPARED, ESTIMATE, ESTIMATE_COLUMNS, RESIDUALS

WINDOW = 10.0  # window (s) of the root mean square of residuals
AXES = ("x", "z")


class Metrics:
    """Metrics of one feed. The package `prometheus_client` calls `collect` of this `Collector`.

    Metrics of tip and residuals are left out if no sample came for `SILENCE` seconds.
    """

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self._samples, self._count, self._generation = 0, 0, 0
        self._grew = time.monotonic()
        self._begun: Counter[tuple[str, str]] = Counter()  # alarms so far, by channel and kind
        self._last_alarm = 0  # number of the last one of these

    def follow(self) -> None:
        """Count the stroke samples since the last call. To be called often."""
        store = self._feed.store
        table = store.tables.get(EVERY_STROKE)
        count = 0 if table is None else table.count
        new = count - (self._count if store.generation == self._generation else 0)
        self._count, self._generation = count, store.generation
        if new:
            self._samples, self._grew = self._samples + new, time.monotonic()

    def text(self) -> tuple[bytes, str]:
        return generate_latest(self), CONTENT_TYPE_LATEST

    def collect(self) -> Iterator[Any]:
        self.follow()
        is_live, age = self._feed.end is None, time.monotonic() - self._grew
        yield self._counter("stroke_samples", "Stroke samples with a prediction, as the monitor received them.", self._samples)
        if is_live:
            words = "Time since the newest prediction reached the monitor, or since the monitor started."
            yield self._gauge("newest_sample_age_seconds", words, [((), age)])
        if not is_live or age <= SILENCE:
            yield from self._tip()
            yield self._residuals()
        yield from self._lamps()
        yield from self._alarms()
        dropped = [((loss["topic"],), loss["count"]) for loss in self._feed.topic_rows.dropped.losses()]
        yield self._counter("monitor_dropped_messages", "Messages that the monitor could not use.", dropped, "topic")

    def _tip(self) -> Iterator[Any]:
        displacement, acceleration = (self._newest(name) for name in (EVERY_STROKE, "acceleration"))
        estimate = dict(zip(ESTIMATE_COLUMNS, self._newest(ESTIMATE) or (), strict=False))
        for name, words, predicted, end in (
            ("tip_displacement_meters", "Deflection of the tip, axes of base_link.", displacement, "m"),
            ("tip_acceleration_meters_per_second_squared", "Acceleration of the tip without gravity.", acceleration, "m_s2"),
        ):
            rows = [(("predicted", axis), value) for axis, value in zip(AXES, predicted or (), strict=False)]
            rows += [(("estimated", axis), estimate[f"{axis}_{end}"]) for axis in AXES if estimate]
            yield self._gauge(name, words, rows, "source", "axis")
        loads = [((axis,), estimate[f"load_{axis}_N"]) for axis in AXES if estimate]
        yield self._gauge("tip_load_newtons", "Estimated force at the tip that the model does not know.", loads, "axis")

    def _residuals(self) -> Any:
        rows = [((name,), rms) for name, rms in self._normalised_rms()]
        words = f"Root mean square of the last {WINDOW:g} s of residual over expected deviation, 1 as expected."
        return self._gauge("residual_normalised_rms_ratio", words, rows, "channel")

    def _normalised_rms(self) -> Iterator[tuple[str, float]]:
        end = "_normalised"
        for name in RESIDUALS.values():
            if (table := self._fresh(name)) is not None:
                for column, values in zip(table.columns, self._window(table).T, strict=True):
                    if column.endswith(end):
                        yield from _rms(column.removesuffix(end), values)
        if (table := self._fresh("force")) is not None:
            measured, predicted, sigma = np.split(self._window(table), 3, axis=1)
            for name, values in zip(SENSORS[COMPARED].channels(0), ((measured - predicted) / sigma).T, strict=True):
                yield from _rms(name, values)

    def _lamps(self) -> Iterator[Any]:
        """Yield the levels of all components, irregular samples, and the tip's swing."""
        now = self._feed.now()
        lamps: dict[str, StatusLamp] = {}
        for lamp in (each for group in self._feed.store.statuses(now).groups(now).values() for each in group):
            if lamp.name not in lamps or lamp.level > lamps[lamp.name].level:
                lamps[lamp.name] = lamp
        levels = [((name,), LEVELS.index(lamp.level)) for name, lamp in lamps.items() if lamp.level in LEVELS]
        yield self._gauge("component_level", "Level on /diagnostics: 0 OK, 1 WARN, 2 ERROR, 3 STALE.", levels, "component")
        counted = {key.rpartition(": ")[::2]: n for key, n in lamps["model"].figures.items()} if "model" in lamps else {}
        rows = [((stream, event), count) for (stream, event), count in counted.items() if event in EVENTS]
        words = "Irregular samples as the twin counts them; late, duplicate, empty, implausible ones are left out."
        yield self._counter("irregular_samples", words, rows, "stream", "event")
        swing = lamps["swing"].figures.get("swing_m") if "swing" in lamps else None
        yield self._gauge(
            "tip_swing_meters", "Largest distance of the tip from its mean over 4 s.", [] if swing is None else [((), swing)]
        )

    def _alarms(self) -> Iterator[Any]:
        faults = [alarm for alarm in self._feed.store.alarms.all if alarm.fault]
        self._begun.update((alarm.name, alarm.fault) for alarm in faults if alarm.number > self._last_alarm)
        self._last_alarm = max((alarm.number for alarm in faults), default=self._last_alarm)
        active = Counter((alarm.name, alarm.fault, alarm.cause or "") for alarm in faults if alarm.end is None)
        labels = "channel", "kind", "cause"
        yield self._gauge("alarms_active", "Alarms that last; an empty cause is not known.", [*active.items()], *labels)
        yield self._counter("alarms", "Alarms since the monitor started.", [*self._begun.items()], *labels[:2])

    # -- rows and families --------------------------------------------------------------------------------------------

    def _fresh(self, name: str) -> Table | None:
        store = self._feed.store
        table = store.tables.get(name)
        return table if table is not None and table.count and store.newest - table.newest <= SILENCE else None

    def _newest(self, name: str) -> list[float] | None:
        table = self._fresh(name)
        return None if table is None else [float(value) for value in table.rows(table.count - 1, table.count)[1][0]]

    def _window(self, table: Table) -> Array:
        return table.rows(table.until(table.newest - WINDOW), table.count)[1].astype(float)

    def _gauge(self, name: str, words: str, rows: Any, *labels: str) -> Any:
        return self._family(GaugeMetricFamily, name, words, rows, labels)

    def _counter(self, name: str, words: str, rows: Any, *labels: str) -> Any:
        return self._family(CounterMetricFamily, name, words, rows if isinstance(rows, list) else [((), rows)], labels)

    def _family(self, kind: Any, name: str, words: str, rows: list[tuple[tuple[str, ...], float]], labels: Any) -> Any:
        found = kind(f"boom_twin_{name}", words, labels=("boom", *labels))
        for values, number in rows:
            found.add_metric((self._feed.boom, *values), number)
        return found


def _rms(channel: str, values: Array) -> Iterator[tuple[str, float]]:
    known = values[np.isfinite(values)]
    if len(known):
        yield channel, float(np.sqrt(np.mean(known**2)))
