"""Check messages before their numbers become rows; drop and count, by topic, those that cannot be used."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from math import isnan
from typing import Any

from ...messages.sample_decoder import LATEST, MOST_NAMES, stamp_of
from ...system.terminal_text import printable
from ...types import SENSORS, Stream, stream_of

LOG = logging.getLogger("boom_twin.monitor.data.dropped_messages")
LONGEST_REASON, LONGEST_TEXT = 200, 500  # characters of a reason, and of another text, that are kept
LARGEST_NUMBER = 1e12  # largest magnitude of a number: none of the twin's, in SI units, comes near it


class MalformedError(Exception):
    """Error of a message that cannot be used; the text states why."""


@dataclass(slots=True)
class TopicLoss:
    """Count of the dropped messages of one topic, and the reason of the last one."""

    topic: str
    count: int
    reason: str


class DroppedMessages:
    """Counter of dropped messages; each is logged, at the rate of `boom_twin.monitor.connections.LogRateLimit`."""

    def __init__(self) -> None:
        self.by_topic: dict[str, TopicLoss] = {}

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
        """Return the losses as plain values, the most messages first."""
        return [asdict(loss) for loss in sorted(self.by_topic.values(), key=lambda loss: -loss.count)]

    def _add(self, topic: str, reason: str) -> None:
        loss = self.by_topic.setdefault(topic, TopicLoss(topic, 0, ""))
        loss.count, loss.reason = loss.count + 1, printable(reason[:LONGEST_REASON], keep="")
        LOG.getChild(topic).warning("dropped message %d of %s: %s", loss.count, topic, loss.reason)


def check_stamp(msg: Any) -> int:
    """Return ``header.stamp`` in ns; raise MalformedError unless it is after 1970 and fits into a message."""
    return check_instant(stamp_of(msg))


def check_instant(found: int) -> int:
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


def text(found: str) -> str:
    """Return a text as it may be shown: the beginning of a long one, control characters as escapes."""
    return printable(found[:LONGEST_TEXT], keep="")
