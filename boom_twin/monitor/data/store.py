"""Store of the live page: bounded tables of numbers by time, and the state of the status indicators.

Messages are checked before their numbers become rows. Those that cannot be used are dropped and counted by topic.
"""

from __future__ import annotations

import logging
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import isnan
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...messages.sample_decoder import LATEST, MOST_NAMES
from ...system.terminal_text import printable
from ...types import NANO, SECOND, SENSORS, Stream, stream_of
from .status import AlarmList, StatusTable

Rows = tuple[NDArray[np.float64], NDArray[np.float32]]


class Table:
    """Ring buffer of rows: named columns (``x_m``) and a time. It grows up to `capacity`, then the oldest rows are dropped."""

    def __init__(self, name: str, columns: Sequence[str], capacity: int) -> None:
        first_room = 1024  # initial capacity of a table, rows
        self.name, self.columns, self._capacity = name, tuple(columns), capacity
        self.count = 0  # rows ever added; row numbers begin at 0
        self._times = np.zeros(min(capacity, first_room))
        self._values = np.zeros((len(self._times), len(columns)), dtype=np.float32)

    @property
    def first(self) -> int:
        """Number of the oldest row that is kept."""
        return max(0, self.count - len(self._times))

    @property
    def newest(self) -> float:
        """Time of the newest row, s; minus infinity if empty."""
        return float(self._times[(self.count - 1) % len(self._times)]) if self.count else -np.inf

    def append(self, time: float, values: Sequence[float]) -> None:
        """Add a row: `time` (s), values (columns,)."""
        if self.count == len(self._times) < self._capacity:
            more = min(self.count, self._capacity - self.count)
            self._times = np.pad(self._times, (0, more))
            self._values = np.pad(self._values, ((0, more), (0, 0)))
        place = self.count % len(self._times)
        self._times[place], self._values[place] = time, values
        self.count += 1

    def until(self, time: float) -> int:
        """Return the number of the first row after `time` (s). Rows are sorted."""
        size = len(self._times)
        return bisect_right(range(self.first, self.count), time, key=lambda row: self._times[row % size]) + self.first

    def rows(self, first: int, end: int) -> Rows:
        """Return times (k,) and values (k, columns) of the kept rows `first` .. `end` - 1."""
        places = np.arange(max(first, self.first), min(end, self.count)) % len(self._times)
        return self._times[places], self._values[places]


EVERY_STROKE, GAP = "displacement", 0.1
"""Table with a row for every stroke sample; pause (s) between its rows that raises an alarm."""


class Store:
    """Data of a feed: tables of at most `capacity` rows, states of the lamps (all, for a recording), alarms.

    By default a table keeps twelve minutes at 200 Hz.
    """

    def __init__(self, capacity: int = 150_000, keeps_statuses: bool = False) -> None:
        self._capacity, self._keeps_statuses = capacity, keeps_statuses
        self.driven_by = Stream.STROKES  # stream whose samples the model follows
        self.generation = 0  # incremented when a clock set back deletes all rows
        self.epoch = self._before = 0  # first stamp (ns), origin of times; the one before all rows were deleted
        self.newest = 0.0  # newest time of all tables, s
        self.tables: dict[str, Table] = {}  # in the order of their first row
        self.alarms = AlarmList()
        self._statuses: list[tuple[float, StatusTable]] = []
        self._last: dict[str, int] = {}  # stamp (ns) of the newest row of every table
        self._held: dict[str, tuple[int, Sequence[float]]] = {}

    def clear(self) -> None:
        """Delete all rows and the epoch; keep the lamps."""
        self.generation += 1
        self._before, self.epoch, self.newest = self.epoch or self._before, 0, 0.0
        self.tables, self._last, self._held = {}, {}, {}

    def time(self, stamp: int) -> float:
        """Return the seconds since the epoch, which the first stamp (ns) sets."""
        if not self.epoch:
            self.epoch = stamp
            if self._before:
                self.alarms.shift((self._before - stamp) * NANO)
        return (stamp - self.epoch) * NANO

    def receive(self, name: str, columns: Sequence[str], stamp: int, values: Sequence[float]) -> None:
        """Add a row to a table; MalformedError if its stamp is not after the last one or the columns differ.

        A row with a jump in its stamp is held until the next row of its table. If that follows closely, both are added.
        Otherwise the held row was an outlier, which is an error. A clock set back deletes all earlier rows.
        """
        leap_ahead = 60 * SECOND  # largest forward step (ns) that is no leap; rows of a table are closer together
        set_back = SECOND  # largest backward step (ns) of a stamp that is out of order; beyond it the clock may be set back
        if name in self.tables and self.tables[name].columns != tuple(columns):
            raise MalformedError(_difference(self.tables[name].columns, columns))
        last, held = self._last.get(name, stamp - 1), self._held.get(name)
        is_leap = not -set_back <= stamp - last <= leap_ahead
        if not is_leap and stamp <= last:
            raise MalformedError(f"its stamp is not after the last one but {(last - stamp) * NANO:.9g} s before it")
        self._held.pop(name, None)
        if is_leap and held is not None and 0 < stamp - held[0] <= leap_ahead:
            if stamp < last:
                self.clear()
            self.append(name, columns, *held)
            held = None
        elif is_leap:
            self._held[name] = stamp, values
        if name not in self._held:
            self.append(name, columns, stamp, values)
            self._last[name] = stamp
        if held is not None:
            raise MalformedError(f"its stamp leaps by {(held[0] - last) * NANO:.9g} s, and the next one's does not")

    def append(self, name: str, columns: Sequence[str], stamp: int, values: Sequence[float]) -> None:
        """Add a row to a table; the first row creates the table."""
        if name not in self.tables:
            self.tables[name] = Table(name, columns, self._capacity)
        table, time = self.tables[name], self.time(stamp)
        if name == EVERY_STROKE and table.count and time - table.newest > GAP:
            self.alarms.add_gap(self.driven_by.value, table.newest, time)
        table.append(time, values)
        self.newest = max(self.newest, time)

    def set_statuses(self, time: float, statuses: StatusTable) -> None:
        """Set the lamps from `time` (s, lamps' clock) on and update the alarms."""
        max_statuses = 100_000  # largest number of kept states of the lamps, about a day
        if not self._keeps_statuses:
            self._statuses.clear()
        self._statuses.append((time, statuses))
        if len(self._statuses) > max_statuses:
            del self._statuses[: max_statuses // 2]
        self.alarms.follow(self.newest, statuses)

    def statuses(self, time: float) -> StatusTable:
        """Return the lamps as last reported at `time` (s)."""
        place = bisect_right(self._statuses, time, key=itemgetter(0)) if self._keeps_statuses else len(self._statuses)
        return self._statuses[place - 1][1] if place else StatusTable()


def _difference(first: Sequence[str], columns: Sequence[str]) -> str:
    odd = [name for name in (*columns, *first) if (name in columns) != (name in first)]
    told = f"{odd[0]} is only in one of them" if odd else "in another order"
    return f"{len(columns)} numbers, but {len(first)} at first ({told}); start the monitor again if the scene was changed"


LOG = logging.getLogger("boom_twin.monitor.data.dropped_messages")
LONGEST_REASON = 200  # characters of a reason that are kept
LARGEST_NUMBER = 1e12  # largest magnitude of a number: none of the twin's, in SI units, comes near it


class MalformedError(Exception):
    """Error of a message that cannot be used; the text states why."""


def is_logged(count: int) -> bool:
    """Return True for the first, second, fourth, eighth, .. event of a kind, so that a flood of them does not fill the log."""
    return count & (count - 1) == 0


class DroppedMessages:
    """Counter of dropped messages, which are logged, see `is_logged`."""

    def __init__(self) -> None:
        self.by_topic: dict[str, dict[str, Any]] = {}  # topic, count, and reason of the last one

    @contextmanager
    def guard(self, topic: str) -> Iterator[None]:
        """Drop and count the message that is taken within, if anything is wrong with it."""
        try:
            yield
        except MalformedError as error:
            self._add(topic, str(error))
        except Exception as error:  # whatever a message holds, the page goes on
            self._add(topic, f"cannot be read: {type(error).__name__}: {error}")

    def losses(self) -> list[dict[str, Any]]:
        """Return the losses of all topics, the most messages first."""
        return sorted(self.by_topic.values(), key=lambda loss: -loss["count"])

    def _add(self, topic: str, reason: str) -> None:
        count = self.by_topic[topic]["count"] + 1 if topic in self.by_topic else 1
        self.by_topic[topic] = {"topic": topic, "count": count, "reason": printable(reason[:LONGEST_REASON], keep="")}
        if is_logged(count):
            LOG.warning("dropped message %d of %s: %s", count, topic, self.by_topic[topic]["reason"])


def check_stamp(found: int) -> int:
    """Return the stamp `found` (ns); raise MalformedError unless it is after 1970 and fits into a message."""
    if not 0 < found < LATEST:
        raise MalformedError("no stamp" if found == 0 else f"impossible stamp {found / 1e9:.9g} s")
    return found


def check_numbers(values: Sequence[float], *, may_lack: bool = False) -> list[float]:
    """Return the values as floats; raise MalformedError above `LARGEST_NUMBER`, or for NaN unless a sensor `may_lack`."""
    found = [float(value) for value in values]
    for value in found:
        if not abs(value) <= LARGEST_NUMBER and not (may_lack and isnan(value)):
            raise MalformedError(f"a number is {value:g}; at most {LARGEST_NUMBER:g} is possible")
    return found


def check_count(what: str, found: int, most: int) -> None:
    """Raise MalformedError if there are more than `most`."""
    if found > most:
        raise MalformedError(f"{found} {what}, at most {most} are possible")


def check_residuals(names: Sequence[str]) -> Stream:
    """Return the stream of these channels; raise MalformedError unless each is named once, an IMU's axes in their order."""
    stream = stream_of(names[0]) if names else None
    odd = next((name for name in names if stream is None or stream_of(name) is not stream), None)
    if odd is not None or stream is None or len(set(names)) != len(names):
        raise MalformedError(f"names of sensors, each once, are expected; not {odd if odd is not None else list(names)!r}")
    if SENSORS[stream].ends and tuple(names) != SENSORS[stream].channels(0):
        raise MalformedError(f"{', '.join(SENSORS[stream].channels(0))} are expected; not {', '.join(map(repr, names))}")
    return stream


def check_arrays(msg: Any, *fields: str) -> None:
    """Raise MalformedError unless every array in `fields` of a sensor_msgs/JointState has one value for every name."""
    check_count("names", len(msg.name), MOST_NAMES)
    found = {field: len(getattr(msg, field)) for field in fields}
    if any(length != len(msg.name) for length in found.values()):
        lengths = ", ".join(f"{length} of {field}" for field, length in found.items())
        raise MalformedError(f"{len(msg.name)} names, but {lengths}")
