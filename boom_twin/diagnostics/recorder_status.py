"""Status of a recording: lost messages, delay to the disk, disk space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .levels import Bounds, ComponentJudge, Level, Status

ENDED = "ended"  # key with value 1 in the last status of a recording


@dataclass(frozen=True, slots=True)
class DiskState:
    """State of a recording's files and of the disk."""

    lag: float  # age of the oldest message that a power failure would lose, s
    waiting: int  # bytes of messages in memory
    written: int  # bytes of all files
    free: int  # free bytes of the disk
    left: float  # time until the disk is full at this recording's mean rate, s


@dataclass(frozen=True, slots=True)
class TopicCount:
    """Message counts of one topic. `missed`: left out or not received; None unless there was one publisher."""

    topic: str
    received: int
    written: int
    missed: int | None


def recording_status(judge: ComponentJudge, counts: Sequence[TopicCount], disk: DiskState, end: str | None) -> Status:
    """Return the status of a recording. `end` is the fault that ended it, empty without one, None while it runs."""
    thresholds, missed = judge.at.thresholds, sum(count.missed or 0 for count in counts)
    if end:
        judge.fault(Level.ERROR, end)
    judge.check("never_arrived", missed, Bounds(warn=0), "messages were published and never arrived")
    told = "messages wait too long to be written to the disk"
    judge.check("lag_s", disk.lag, Bounds(thresholds.lag_warn, thresholds.lag_error), told)
    room = Bounds(thresholds.disk_warn, thresholds.disk_error, low=True)
    judge.check("disk_left_s", disk.left, room, "the disk will soon be full")
    judge.note({} if end is None else {ENDED: 1})
    judge.note({"disk_free_bytes": disk.free, "waiting_bytes": disk.waiting, "written_bytes": disk.written})
    for count in counts:
        missing = "nan" if count.missed is None else count.missed
        judge.note({f"received {count.topic}": count.received, f"never_arrived {count.topic}": missing})
    return judge.finish("running" if end is None else "ended")
