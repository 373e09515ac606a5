"""Status of the sources: whether every input topic has one publisher, and whether all its messages are received in time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan

from ..config.settings import Thresholds
from ..types import Stream
from .levels import Bounds, ComponentJudge, Evaluation, Status
from .topic_status import Peers

FOLLOWED = "Followed is the one whose stamps go on, and which of them that is ROS does not tell. End all but one"


class PublishersJudge:
    """Judge of the publishers of all input topics. A second source makes all predictions doubtful, so it is reported first."""

    def __init__(self) -> None:
        self._judge = ComponentJudge("publishers")

    def status(self, publishers: Mapping[Stream, Peers], followed: Mapping[Stream, str], at: Evaluation) -> Status:
        """Return the status of the sources.

        Parameters
        ----------
        publishers : dict of Stream to Peers
            Streams that come by one topic may have a publisher each.
        followed : dict of Stream to str
            Stamp of the newest sample of each, s.
        at : Evaluation
        """
        judge = self._judge
        judge.begin(at)
        streams: dict[str, list[Stream]] = {}
        for stream, peers in publishers.items():
            streams.setdefault(peers.address, []).append(stream)
        for address, sharing in streams.items():
            names = publishers[sharing[0]].names
            judge.note(f"{address} publishers", ", ".join(names))
            judge.note(f"{address} gids", ", ".join(publishers[sharing[0]].ids))
            told = f"{len(names)} publishers of {address}: {', '.join(names)}. {FOLLOWED}"
            surplus = Bounds(error=0.0)
            judge.check(f"{address} surplus", max(0, len(names) - len(sharing)), surplus, told, at_once=True)
            judge.note(f"{address} newest_stamp_s", followed[sharing[0]])
        return judge.finish("one source for every topic")


@dataclass(frozen=True, slots=True)
class Reception:
    """Reception of one topic; counts since the node was activated.

    Attributes
    ----------
    received : int
        Messages that arrived.
    lost : int
        That never arrived, by the publisher's numbers, as far as one publisher can be told: see `is_numbered`.
    dropped : int
        That arrived and gave way to newer ones before they were read.
    waiting : int
        That wait now.
    wait, latency : float
        Longest time (s) from arrival to being read, and to being answered, since the last look; NaN without any.
    is_numbered : bool
        Whether the numbers since the last look were those of one publisher.
    """

    received: int = 0
    lost: int = 0
    dropped: int = 0
    waiting: int = 0
    wait: float = nan
    latency: float = nan
    is_numbered: bool = True


class ReceptionJudge:
    """Judge of the reception of all input topics."""

    def __init__(self) -> None:
        self._judge = ComponentJudge("reception")
        self._before: dict[str, Reception] = {}
        self._left_out: dict[str, int] = {}

    def status(self, topics: Mapping[str, Reception], left_out: Mapping[str, int], at: Evaluation) -> Status:
        """Return the status of the reception.

        `topics` are by name. `left_out` counts, by kind and in all, what was left out for lack of time.
        """
        judge = self._judge
        judge.begin(at)
        for name, each in topics.items():
            self._check(name, each, at.thresholds)
        for name, count in left_out.items():
            new = count - self._left_out.get(name, 0)
            told = f"too many messages for the time there is: {new} {name} left out, no prediction"
            judge.check(f"{name} left_out", new, Bounds(warn=0), told, at_once=True)
        self._before, self._left_out = dict(topics), dict(left_out)
        return judge.finish("all that arrives is read at once")

    def _check(self, name: str, each: Reception, thresholds: Thresholds) -> None:
        before = self._before.get(name, Reception())
        if each.received < before.received:  # counted anew
            before = Reception()
        lost, dropped = each.lost - before.lost, each.dropped - before.dropped
        published = each.received - before.received + lost
        share = (lost + dropped) / published if published else nan
        for key in ("received", "lost", "dropped", "waiting"):
            self._judge.note(f"{name} {key}", getattr(each, key))
        told = f"{name}: {share:.0%} of the messages were not read ({lost} never arrived, {dropped} gave way to newer ones)"
        bounds = Bounds(thresholds.unread_warn, thresholds.unread_error)
        self._judge.check(f"{name} unread_share", share, bounds, told)
        self._judge.note(f"{name} latency_s", each.latency)
        told = f"{name}: messages wait {each.wait:.3f} s for their turn: too many come, or the model is too slow"
        self._judge.check(f"{name} wait_s", each.wait, Bounds(thresholds.wait_warn, thresholds.wait_error), told)
        if not each.is_numbered:
            self._judge.note(f"{name} lost", "unknown: numbers of several publishers, or of one that started anew")
