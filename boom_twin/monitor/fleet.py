"""Interfaces to other programs: metrics at ``/metrics`` for Prometheus, and a webhook that posts changes of alarms."""

from __future__ import annotations

import asyncio
import logging
import socket
import time
from collections import Counter
from collections.abc import AsyncIterator, Iterator, Mapping
from contextlib import asynccontextmanager, suppress
from datetime import UTC, datetime, timedelta
from http import HTTPStatus
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from aiohttp import ClientError, ClientSession, ClientTimeout
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily

from ..errors import UsageError
from ..twin.blocks import EVENTS
from ..types import SECOND, SENSORS, Array
from .data.feed import Feed
from .data.status import LEVELS, SILENCE, ListedAlarm, StatusLamp
from .data.store import EVERY_STROKE, Table
from .data.topic_rows import COMPARED, ESTIMATE, ESTIMATE_COLUMNS, RESIDUALS

LOG = logging.getLogger("boom_twin.monitor.webhook")
MAX_WAITING = 100  # largest number of waiting messages; one more replaces the oldest
PAUSES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)  # pauses (s) before further attempts
CLOSING_TIME = 2.0  # time (s) for waiting messages when the monitor ends


class Webhook:
    """Poster of JSON objects to `url` (http or https, else UsageError), each with the name of this machine as ``host``.

    The log names the server only, because a path may hold a secret. Redirections are not followed.
    """

    def __init__(self, url: str) -> None:
        try:
            parts = urlsplit(url)
            self._server, is_right = parts.netloc.rpartition("@")[2], parts.scheme in ("http", "https") and bool(parts.hostname)
            is_right &= parts.port != 0
        except ValueError:
            is_right = False
        if not is_right:
            raise UsageError("--webhook: not an address of http or https. Give one as https://example.org/alarms.")
        self._url, self._host = url, socket.gethostname()
        self._waiting: asyncio.Queue[Mapping[str, Any]] = asyncio.Queue(MAX_WAITING)

    def put(self, message: Mapping[str, Any]) -> None:
        if self._waiting.full():
            self._give_up(self._waiting.get_nowait(), f"more than {MAX_WAITING} messages wait")
            self._waiting.task_done()
        self._waiting.put_nowait(message)

    @asynccontextmanager
    async def posting(self) -> AsyncIterator[None]:
        """Post messages within a context; at its end, waiting ones have `CLOSING_TIME`."""
        task = asyncio.create_task(self._post_all())
        try:
            yield
        finally:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._waiting.join(), CLOSING_TIME)
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task
            while not self._waiting.empty():
                self._give_up(self._waiting.get_nowait(), "the monitor ends")

    async def _post_all(self) -> None:
        post_time = 10.0  # timeout (s) of one attempt
        async with ClientSession(timeout=ClientTimeout(total=post_time)) as session:
            while True:
                message = await self._waiting.get()
                reason = "the monitor ends"
                try:
                    reason = await self._attempts(session, message)
                finally:
                    if reason:
                        self._give_up(message, reason)
                    self._waiting.task_done()

    async def _attempts(self, session: ClientSession, message: Mapping[str, Any]) -> str:
        """Post a message until an attempt succeeds. Return "", or the reason of the last failure."""
        for pause in (*PAUSES, 0.0):
            if not (reason := await self._post(session, message)):
                return ""
            await asyncio.sleep(pause)
        return f"{reason}; {len(PAUSES) + 1} attempts"

    async def _post(self, session: ClientSession, message: Mapping[str, Any]) -> str:
        """Make one attempt. Return the reason of its failure, or ""."""
        try:
            async with session.post(self._url, json={"host": self._host, **message}, allow_redirects=False) as response:
                is_taken = HTTPStatus.OK <= response.status < HTTPStatus.MULTIPLE_CHOICES
                return "" if is_taken else f"its answer is {response.status}"
        except (ClientError, TimeoutError, OSError, ValueError) as error:
            return f"not posted ({type(error).__name__})"

    def _give_up(self, message: Mapping[str, Any], reason: str) -> None:
        told = f"{message['event']} of alarm {message['channel']} ({message['kind']}) from {message['from']}"
        LOG.warning("webhook %s: gave up the message %s: %s", self._server, told, reason)


BEGIN, CAUSE, END = "begin", "cause", "end"  # kinds of changes


class AlarmWatch:
    """Watch of one feed's alarms with channel and kind: alarms of the rig's health, and gaps."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self._known: dict[int, tuple[str | None, bool]] = {}  # (cause, has ended) by number of the alarm
        self.begun: Counter[tuple[str, str]] = Counter()  # alarms so far, by channel and kind

    def changes(self) -> list[dict[str, Any]]:
        """Return the changes since the last call, as plain values for JSON, oldest alarm first.

        After a clock was set back, changes wait until the origin of times is known.
        """
        if not self._feed.store.epoch:
            return []
        found: list[dict[str, Any]] = []
        known, self._known = self._known, {}
        for alarm in self._feed.store.alarms.all:
            if not alarm.fault:
                continue
            cause, has_ended = self._known[alarm.number] = alarm.cause, alarm.end is not None
            if alarm.number not in known:
                self.begun[alarm.name, alarm.fault] += 1
                kinds = [BEGIN, END] if has_ended else [BEGIN]
            else:
                before, had_ended = known[alarm.number]
                kinds = [kind for kind, is_new in ((CAUSE, cause != before), (END, has_ended and not had_ended)) if is_new]
            found += [self._change(kind, alarm) for kind in kinds]
        return found

    def _change(self, kind: str, alarm: ListedAlarm) -> dict[str, Any]:
        return {
            "event": kind,
            "boom": self._feed.boom,
            "source": self._feed.title,
            "channel": alarm.name,
            "kind": alarm.fault,
            "cause": alarm.cause,
            "text": alarm.reason,
            "evidence": alarm.evidence,
            "stop": alarm.stops,
            "from": self._date(alarm.begin),
            "to": self._date(alarm.end) if kind == END and alarm.end is not None else None,
        }

    def _date(self, time: float) -> str:
        stamp = self._feed.store.epoch + round(time * SECOND)
        date = datetime.fromtimestamp(stamp // SECOND, UTC) + timedelta(microseconds=stamp % SECOND // 1000)
        return date.isoformat(timespec="microseconds").replace("+00:00", "Z")


WINDOW = 10.0  # window (s) of the root mean square of residuals
AXES = ("x", "z")


class Metrics:
    """Metrics of one feed. The package `prometheus_client` calls `collect` of this `Collector`.

    Metrics of tip and residuals are left out if no sample came for `SILENCE` seconds. `watch` has the alarms of the feed.
    """

    def __init__(self, feed: Feed, watch: AlarmWatch) -> None:
        self._feed, self._watch = feed, watch
        self._samples, self._count, self._generation = 0, 0, 0
        self._grew = time.monotonic()

    def follow(self) -> None:
        """Count the stroke samples since the last call."""
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
        lasting = [alarm for alarm in self._feed.store.alarms.all if alarm.fault and alarm.end is None]
        active = Counter((alarm.name, alarm.fault, alarm.cause or "") for alarm in lasting)
        labels = "channel", "kind", "cause"
        yield self._gauge("alarms_active", "Alarms that last; an empty cause is not known.", [*active.items()], *labels)
        yield self._counter("alarms", "Alarms since the monitor started.", [*self._watch.begun.items()], *labels[:2])

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
