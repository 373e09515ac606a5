"""Changes of a recorded session, each told before the stroke sample that it began with."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from ..records import Change
from .change_messages import decode_changes
from .reader import Session, read
from .topics import Output, Topics

NEAR = 2_000_000_000
"""Nanoseconds, of log time and of stamps, within which a change and its stroke sample are looked for.

A looped session repeats stamps; a stray stamp is far from its stream.
"""


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
