"""Whether the outputs can be heard."""

from __future__ import annotations

from collections.abc import Iterable

from ..thresholds import Thresholds
from .judge import Judge
from .peers import Peers
from .status import Level, Status


class OutputsJudge:
    """Judges all output topics together."""

    def __init__(self) -> None:
        self._judge = Judge("outputs")

    def status(self, peers: Iterable[Peers], thresholds: Thresholds, now: float, clock: float) -> Status:
        """State of the outputs; `peers` are their subscribers, times as for `boom_twin.watch.sensor.SensorJudge`."""
        judge = self._judge
        judge.begin(now, thresholds)
        for each in peers:
            judge.note(f"subscribers {each.address}", len(each.names))
            if each.incompatible:
                judge.fault(Level.WARN, f"{each.address}: incompatible QoS: {'; '.join(each.incompatible)}")
        return judge.finish(clock, "offered")
