"""Status of input and output topics: rates, gaps, publishers and subscribers at the other end."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import nan

from ..types import NANO, SECOND
from .levels import Bounds, ComponentJudge, Evaluation, Level, Status
from .stream_stats import StreamWatch

OTHER_USER = (
    "If it sends as another user of this machine, which shared memory keeps apart: run both as one user, or set "
    "FASTDDS_BUILTIN_TRANSPORTS=UDPv4 for it and leave ROS_AUTOMATIC_DISCOVERY_RANGE unset"
)
"""Why endpoints of Fast DDS match and nothing arrives; measured with rmw_fastrtps 8.4.3."""


@dataclass(frozen=True, slots=True)
class Peers:
    """Publishers of an input, or subscribers of an output.

    Attributes
    ----------
    address : str
        Name of the topic as it is resolved.
    names : sequence of str
        Their nodes.
    incompatible : sequence of str
        Those of them that cannot hear or be heard for their quality of service, and why, in words.
    ids : sequence of str
        GIDs, hexadecimal, in the order of `names`.
    rivals : int
        Publishers of an output beside the node's own.
    mistyped : sequence of str
        Others at this topic, which have another type of message and so neither hear nor are heard, with that type, in words.
    """

    address: str = ""
    names: Sequence[str] = ()
    incompatible: Sequence[str] = ()
    ids: Sequence[str] = ()
    rivals: int = 0
    mistyped: Sequence[str] = ()


class TopicJudge:
    """Judge of one input topic.

    Parameters
    ----------
    name : str
        As in ``topics.yaml``.
    required : bool
        Whether the twin needs it.
    """

    def __init__(self, name: str, required: bool) -> None:
        self._judge, self._required = ComponentJudge(name), required
        self._counted = (nan, 0)

    def status(
        self,
        stream: StreamWatch,
        publishers: Peers,
        offset: float,
        at: Evaluation,
        wrong_names: tuple[Level, str] | None = None,
    ) -> Status:
        """Return the status of the topic.

        Parameters
        ----------
        stream : StreamWatch
            After its look.
        publishers : Peers
        offset : float
            By how much the stamps are behind those of the strokes, s; NaN where it is not known.
        at : Evaluation
        wrong_names : tuple of Level and str, optional
            What is wrong with the names in its messages, in words.
        """
        judge, age = self._judge, stream.age(at.now)
        judge.begin(at)
        judge.note("topic", publishers.address)
        self._count(stream, at.now)
        if wrong_names is not None:
            judge.fault(*wrong_names)
        judge.note("publishers", len(publishers.names))
        judge.note("publisher_names", ", ".join(publishers.names))
        if publishers.incompatible:
            judge.fault(Level.WARN, "incompatible QoS: " + "; ".join(publishers.incompatible))
        if publishers.mistyped:
            judge.fault(Level.WARN, "another type of message: " + "; ".join(publishers.mistyped))
        if stream.newest is None and not self._required:
            return judge.finish("not there; optional")
        told = f"silent for {age:.1f} s" if stream.newest is not None else "nothing received yet"
        if stream.newest is None and len(publishers.names) > len(publishers.incompatible):
            told += f", though a publisher is there. {OTHER_USER}"
        judge.check_age(age, at.thresholds.stale_after, told)
        if stream.newest is not None:
            judge.note("newest_stamp_s", seconds(stream.newest))
            judge.note("clock_minus_stamp_s", at.clock - stream.newest * NANO)
        where = "behind" if offset > 0.0 else "ahead of"
        told = f"stamped {abs(offset):.3f} s {where} the strokes: synchronise the sensors' clocks"
        judge.check("clock_offset_s", abs(offset), Bounds(at.thresholds.clock_offset), told)
        return judge.finish("listened to" if stream.newest is not None else "waiting for a message")

    def _count(self, stream: StreamWatch, now: float) -> None:
        """Report the number of messages, and their rate since the last look."""
        time, count = self._counted
        self._counted = (now, stream.count)
        self._judge.note("messages", stream.count)
        self._judge.note("rate_Hz", (stream.count - count) / (now - time) if now > time else nan)


def seconds(stamp: int | None) -> str:
    """Return a stamp (ns) in seconds, exactly."""
    return "nan" if stamp is None else f"{stamp // SECOND}.{stamp % SECOND:09d}"


class OutputsJudge:
    """Judge of all output topics together."""

    def __init__(self) -> None:
        self._judge = ComponentJudge("outputs")

    def status(self, peers: Iterable[Peers], at: Evaluation) -> Status:
        """Return the status of the outputs; `peers` are their subscribers."""
        judge, shared = self._judge, 0
        judge.begin(at)
        for each in peers:
            shared += each.rivals > 0
            judge.note(f"subscribers {each.address}", len(each.names))
            if each.incompatible:
                judge.fault(Level.WARN, f"{each.address}: incompatible QoS: {'; '.join(each.incompatible)}")
            if each.mistyped:
                judge.fault(Level.WARN, f"{each.address}: another type of message: {'; '.join(each.mistyped)}")
        if shared:
            told = f"{shared} of them are published by another node too: give each node a namespace of its own, or end one"
            judge.fault(Level.ERROR, told)
        return judge.finish("offered")
