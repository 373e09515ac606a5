"""Statuses of the topics and of a recording: publishers, rates, ages, clocks, lost and waiting messages, disk."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import nan

from ..types import NANO, SECOND, Stream
from .levels import Bounds, ComponentJudge, Level, Status
from .sensor_status import StreamWatch

OTHER_USER = (
    "If it sends as another user of this machine, which shared memory keeps apart: run both as one user, or set "
    "FASTDDS_BUILTIN_TRANSPORTS=UDPv4 for it and leave ROS_AUTOMATIC_DISCOVERY_RANGE unset"
)
"""Possible reason if Fast DDS matches endpoints, but nothing arrives; measured with rmw_fastrtps 8.4.3."""
FOLLOWED = "The twin follows the one whose stamps increase; ROS does not report which one it is. End all but one"


@dataclass(frozen=True, slots=True)
class Peers:
    """Publishers of an input, or subscribers of an output."""

    address: str = ""  # resolved name of the topic
    names: Sequence[str] = ()  # names of their nodes
    incompatible: Sequence[str] = ()  # peers whose quality of service prevents a connection, with the reason in words
    ids: Sequence[str] = ()  # their hexadecimal GIDs, in the order of `names`
    rivals: int = 0  # publishers of an output beside the node's own
    mistyped: Sequence[str] = ()  # other endpoints whose message type prevents a connection, with that type in words

    def warn(self, judge: ComponentJudge, prefix: str = "") -> None:
        """Warn of peers that cannot connect."""
        for fault, found in (("incompatible QoS", self.incompatible), ("another type of message", self.mistyped)):
            if found:
                judge.fault(Level.WARN, f"{prefix}{fault}: {'; '.join(found)}")


def seconds(stamp: int | None) -> str:
    """Return a stamp (ns) in seconds, exactly."""
    return "nan" if stamp is None else f"{stamp // SECOND}.{stamp % SECOND:09d}"


def topic_status(
    judge: ComponentJudge,
    stream: StreamWatch,
    is_required: bool,
    publishers: Peers,
    offset: float,
    wrong_names: tuple[Level, str] | None = None,
) -> Status:
    """Return the status of one input topic, after the look of its `stream`.

    `offset` (s) is the delay of its stamps against those of the strokes; NaN if unknown. `wrong_names` is the fault of the
    names in its messages, if any.
    """
    at, age = judge.at, stream.age(judge.at.now)
    judge.note({"topic": publishers.address, "messages": stream.count, "rate_Hz": stream.arrival_rate(at.now)})
    if wrong_names is not None:
        judge.fault(*wrong_names)
    judge.note({"publishers": len(publishers.names), "publisher_names": ", ".join(publishers.names)})
    publishers.warn(judge)
    if stream.newest is None and not is_required:
        return judge.finish("absent; optional")
    told = "silent" if stream.newest is not None else "nothing received yet"
    if stream.newest is None and len(publishers.names) > len(publishers.incompatible):
        told += f"; though a publisher is there. {OTHER_USER}"
    judge.check_age(age, told)
    if stream.newest is not None:
        judge.note({"newest_stamp_s": seconds(stream.newest), "clock_minus_stamp_s": at.clock - stream.newest * NANO})
    where = "behind" if offset > 0.0 else "ahead of"
    told = f"stamped {where} the strokes: synchronise the sensors' clocks"
    judge.check("clock_offset_s", abs(offset), Bounds(at.thresholds.clock_offset), told)
    return judge.finish("listened to" if stream.newest is not None else "waiting for a message")


def outputs_status(judge: ComponentJudge, subscribers: Iterable[Peers]) -> Status:
    """Return the status of all output topics together."""
    shared = 0
    for each in subscribers:
        shared += each.rivals > 0
        judge.note({f"subscribers {each.address}": len(each.names)})
        each.warn(judge, f"{each.address}: ")
    judge.note({"shared_topics": shared})
    if shared:
        told = "another node publishes them too: give each node a namespace of its own, or end one"
        judge.fault(Level.ERROR, told)
    return judge.finish("offered")


def publishers_status(judge: ComponentJudge, publishers: Mapping[Stream, Peers], followed: Mapping[Stream, str]) -> Status:
    """Return the status of all publishers. It is reported first: a second publisher makes all predictions doubtful.

    Each stream of one topic may have its own publisher. `followed` is the stamp (s) of the newest sample of each stream.
    """
    streams: dict[str, list[Stream]] = {}
    for stream, peers in publishers.items():
        streams.setdefault(peers.address, []).append(stream)
    for address, sharing in streams.items():
        peers, names = publishers[sharing[0]], ", ".join(publishers[sharing[0]].names)
        judge.note({f"{address} publishers": names, f"{address} gids": ", ".join(peers.ids)})
        told = f"several publishers of {address}: {names}. {FOLLOWED}"
        surplus = max(0, len(peers.names) - len(sharing))
        judge.check(f"{address} surplus", surplus, Bounds(error=0.0), told, at_once=True)
        judge.note({f"{address} newest_stamp_s": followed[sharing[0]]})
    return judge.finish("one source for every topic")


@dataclass(frozen=True, slots=True)
class Reception:
    """Reception of one topic; counts since the node was activated."""

    received: int = 0  # messages that arrived
    lost: int = 0  # messages that never arrived, by the publisher's sequence numbers; valid if `is_numbered`
    dropped: int = 0  # messages dropped unread to make room for newer ones
    waiting: int = 0  # messages waiting now
    wait: float = nan  # longest time (s) from arrival to being read since the last look; NaN without any
    latency: float = nan  # longest time (s) from arrival to the report since the last look; NaN without any
    is_numbered: bool = True  # True if the sequence numbers since the last look are those of one publisher


class ReceptionWatch:
    """Judge of the reception of all input topics since the last look."""

    def __init__(self) -> None:
        self._before: dict[str, Reception] = {}

    def status(self, judge: ComponentJudge, topics: Mapping[str, Reception]) -> Status:
        for name, each in topics.items():
            self._check(judge, name, each)
        self._before = dict(topics)
        return judge.finish("every message is read at once")

    def _check(self, judge: ComponentJudge, name: str, each: Reception) -> None:
        before, thresholds = self._before.get(name, Reception()), judge.at.thresholds
        if each.received < before.received:  # count was reset
            before = Reception()
        lost, dropped = each.lost - before.lost, each.dropped - before.dropped
        published = each.received - before.received + lost
        share = (lost + dropped) / published if published else nan
        judge.note({f"{name} {key}": getattr(each, key) for key in ("received", "lost", "dropped", "waiting")})
        told = f"{name}: messages never arrived, or were dropped for newer ones"
        judge.check(f"{name} unread_share", share, Bounds(thresholds.unread_warn, thresholds.unread_error), told)
        judge.note({f"{name} latency_s": each.latency})
        told = f"{name}: messages wait for their turn: too many arrive, or the model is too slow"
        judge.check(f"{name} wait_s", each.wait, Bounds(thresholds.wait_warn, thresholds.wait_error), told)
        if not each.is_numbered:
            judge.note({f"{name} lost": "unknown: numbers of several publishers, or of one that started anew"})


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
