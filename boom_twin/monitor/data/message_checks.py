"""Check a message before its numbers become rows, and count those that are dropped."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan
from typing import Any

from ...messages.sample_decoder import LATEST, LONGEST, stamp_of
from ...system.terminal_text import printable
from ...types import SENSORS, Stream, stream_of
from .dropped_messages import MalformedError

LARGEST = 1e12
"""Largest magnitude of a number: none of the twin's, in SI units, comes near it."""
MOST_COLUMNS = 1000
"""Most numbers of one stamp; a boom of nine sections has some two hundred."""
LONGEST_TEXT = 500
"""Characters of a text that are kept."""


def stamp(msg: Any) -> int:
    """Return ``header.stamp`` in ns; raise MalformedError unless it is after 1970 and fits into a message."""
    return instant(stamp_of(msg))


def instant(found: int) -> int:
    """Return the stamp `found` (ns); raise MalformedError unless it is after 1970 and fits into a message."""
    if not 0 < found < LATEST:
        raise MalformedError("no stamp" if found == 0 else f"impossible stamp {found / 1e9:.9g} s")
    return found


def numbers(values: Sequence[float], *, may_lack: bool = False) -> list[float]:
    """Return the values as floats; raise MalformedError above `LARGEST`, or for NaN unless a sensor `may_lack`."""
    found = [float(value) for value in values]
    for value in found:
        if not abs(value) <= LARGEST and not (may_lack and isnan(value)):
            raise MalformedError(f"a number is {value:g}; at most {LARGEST:g} is possible")
    return found


def count(what: str, found: int, most: int) -> None:
    """Raise MalformedError if there are more than `most`."""
    if found > most:
        raise MalformedError(f"{found} {what}, at most {most} are possible")


def stream_of_residuals(names: Sequence[str]) -> Stream:
    """Return the stream of these channels; raise MalformedError unless each is named once, an IMU's axes in their order."""
    stream = stream_of(names[0]) if names else None
    odd = next((name for name in names if stream is None or stream_of(name) is not stream), None)
    if odd is not None or stream is None or len(set(names)) != len(names):
        raise MalformedError(f"names of sensors, each once, are expected; not {odd if odd is not None else list(names)!r}")
    if SENSORS[stream].ends and tuple(names) != SENSORS[stream].channels(0):
        raise MalformedError(f"{', '.join(SENSORS[stream].channels(0))} are expected; not {', '.join(map(repr, names))}")
    return stream


def named(msg: Any, *fields: str) -> None:
    """Raise MalformedError unless every array in `fields` of a sensor_msgs/JointState has one value for every name.

    Too many names are malformed, too.
    """
    count("names", len(msg.name), LONGEST)
    found = {field: len(getattr(msg, field)) for field in fields}
    if any(length != len(msg.name) for length in found.values()):
        lengths = ", ".join(f"{length} of {field}" for field, length in found.items())
        raise MalformedError(f"{len(msg.name)} names, but {lengths}")


def text(found: str) -> str:
    """Return a text as it may be shown: the beginning of a long one, control characters as escapes."""
    return printable(found[:LONGEST_TEXT], keep="")
