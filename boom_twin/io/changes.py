"""Changes of a running twin, to and from messages: a JointState serves as a stamped list of named values."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

from ..errors import BagError, UsageError
from ..records import Change
from ..settings import Settings
from .factory import RosbagsTypes
from .intake import stamp_of
from .places import fill_header
from .reader import Session, read
from .topics import TYPES, Output, Topics
from .typestore import jazzy

FROM_REST = "from_rest"
NEAR = 2_000_000_000
"""Nanoseconds, of log time and of stamps, within which a change and its stroke sample are looked for.

A looped session repeats stamps; a stray stamp is far from its stream.
"""


def encode_changes(change: Change) -> bytes:
    """The message of a change, in CDR."""
    values = {FROM_REST: float(change.from_rest), **change.settings, **change.zeros}
    types = RosbagsTypes()
    msg = types.make(TYPES[Output.CHANGES])
    fill_header(msg.header, change.stamp)
    msg.name, msg.position = list(values), types.doubles(list(values.values()))
    return bytes(jazzy().serialize_cdr(msg, TYPES[Output.CHANGES]))


def decode_changes(msg: Any) -> Change:
    """The change of a message.

    Raises
    ------
    BagError
        It has names or values that a change cannot have.
    """
    values = dict(zip(msg.name, map(float, msg.position), strict=False))
    from_rest = bool(values.pop(FROM_REST, 0.0))
    settings = {name: values.pop(name) for name in Settings.live_names() if name in values}
    try:
        Settings().tuned(settings)
    except UsageError as error:
        raise BagError(f"a message of changes cannot be used: {error}") from None
    return Change(stamp_of(msg), from_rest, settings, {name: value for name, value in values.items() if value != 0.0})


class Changes:
    """The changes of a session, each to be repeated before the stroke sample that it began with.

    Parameters
    ----------
    logged : iterable of (int, Change)
        With their log times (ns), in that order.
    """

    def __init__(self, logged: Iterable[tuple[int, Change]]) -> None:
        self._waiting = deque(logged)
        self._before = -1

    def due(self, log: int, stamp: int) -> Iterable[Change]:
        """Those that begin with a stroke sample of that log time and stamp (ns).

        A change whose own sample was not recorded begins with the next one.
        """
        while self._waiting and self._begins(*self._waiting[0], log, stamp):
            yield self._waiting.popleft()[1]
        self._before = stamp

    def _begins(self, logged: int, change: Change, log: int, stamp: int) -> bool:
        if abs(log - logged) > NEAR:
            return log > logged
        return stamp == change.stamp or self._before < change.stamp < stamp < change.stamp + NEAR


def recorded_changes(session: Session, topics: Topics) -> Changes:
    """What was changed while the session was recorded, its topics named by `topics`.

    Raises
    ------
    BagError
        The session cannot be read, or holds what is no change.
    """
    topic = topics.outputs[Output.CHANGES]
    info = session.find(topic.absolute)
    if info is None or info.count == 0:
        return Changes([])
    return Changes((log, decode_changes(msg)) for _, log, msg in read(session, {topic.absolute: topic.type}))
