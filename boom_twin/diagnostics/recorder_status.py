"""Status of a recording: whether it is complete, on the disk, and has room."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .levels import Bounds, ComponentJudge, Evaluation, Level, Status

ENDED = "ended"
"""Key of a status that says of itself, by 1, that it is the last one: silence after it is no news."""


@dataclass(frozen=True, slots=True)
class DiskState:
    """State of a recording's files and of the disk.

    Attributes
    ----------
    lag : float
        Age of the oldest message that a loss of power would cost, s.
    waiting : int
        Bytes of messages in memory.
    written : int
        Bytes of all files.
    free : int
        Bytes left on the disk.
    left : float
        Time until the disk is full at the pace of this recording so far, s.
    """

    lag: float
    waiting: int
    written: int
    free: int
    left: float


@dataclass(frozen=True, slots=True)
class TopicState:
    """Message counts of one topic: received, and published but never received (None: not known)."""

    received: int
    missed: int | None


class RecordingJudge:
    """Judge of one recording."""

    def __init__(self) -> None:
        self._judge = ComponentJudge("recording")

    def status(self, topics: Mapping[str, TopicState], disk: DiskState, end: str | None, at: Evaluation) -> Status:
        """Return the status of the recording.

        Parameters
        ----------
        topics : dict of str to TopicState
        disk : DiskState
        end : str or None
            Why it ended too early; empty if it ended in order, None while it runs.
        at : Evaluation
        """
        judge, thresholds = self._judge, at.thresholds
        missed = sum(topic.missed or 0 for topic in topics.values())
        judge.begin(at)
        if end:
            judge.fault(Level.ERROR, end)
        judge.check("never_arrived", missed, Bounds(warn=0), f"{missed} messages were published and never arrived")
        told = f"messages of the last {disk.lag:.1f} s are not on the disk yet"
        judge.check("lag_s", disk.lag, Bounds(thresholds.lag_warn, thresholds.lag_error), told)
        room = Bounds(thresholds.disk_warn, thresholds.disk_error, low=True)
        judge.check("disk_left_s", disk.left, room, f"the disk is full in {disk.left:.0f} s")
        if end is not None:
            judge.note(ENDED, 1)
        judge.note("disk_free_bytes", disk.free)
        judge.note("waiting_bytes", disk.waiting)
        judge.note("written_bytes", disk.written)
        for name, topic in topics.items():
            judge.note(f"received {name}", topic.received)
            judge.note(f"never_arrived {name}", "nan" if topic.missed is None else topic.missed)
        return judge.finish("running" if end is None else "ended")
