"""Whether every input topic has one source."""

from __future__ import annotations

from collections.abc import Mapping

from ..records import Stream
from ..thresholds import Thresholds
from .gate import Bounds
from .judge import Judge
from .peers import Peers
from .status import Status

FOLLOWED = "Followed is the one whose stamps go on, and which of them that is ROS does not tell. End all but one"


class PublishersJudge:
    """Judges all input topics together. A second source makes all that is predicted doubtful: it is told before all else."""

    def __init__(self) -> None:
        self._judge = Judge("publishers")

    def status(
        self,
        publishers: Mapping[Stream, Peers],
        followed: Mapping[Stream, str],
        thresholds: Thresholds,
        now: float,
        clock: float,
    ) -> Status:
        """State of the sources.

        Parameters
        ----------
        publishers : dict of Stream to Peers
            Streams that come by one topic may have a publisher each.
        followed : dict of Stream to str
            Stamp of the newest sample of each, s.
        thresholds : Thresholds
        now, clock : float
            As for `boom_twin.watch.sensor.SensorJudge`.
        """
        judge = self._judge
        judge.begin(now, thresholds)
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
        return judge.finish(clock, "one source for every topic")
