"""Messages for ``/clock``."""

from __future__ import annotations

from ..io.typestore import jazzy

CLOCK, CLOCK_TYPE = "/clock", "rosgraph_msgs/msg/Clock"


def clock_message(stamp: int) -> bytes:
    """A message for ``/clock`` in CDR."""
    types = jazzy().types
    time_class, clock_class = types["builtin_interfaces/msg/Time"], types[CLOCK_TYPE]
    now = time_class(sec=stamp // 1_000_000_000, nanosec=stamp % 1_000_000_000)
    return bytes(jazzy().serialize_cdr(clock_class(clock=now), CLOCK_TYPE))
