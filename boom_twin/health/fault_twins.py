"""Fault twins: twins of a changed boom that take the same samples as the twin of the boom as it is believed to be.

The filter of a twin tells the logarithm of the likelihood of all that was read (`BoomPredictor.evidence`). A fault twin has a
scene with one fault, or lets a sensor's zero drift; `causes` decides by its gains. A twin with the named fault becomes the one
that others are compared with: so a second fault, and the end of the first, are named in the same way.

The twins run in a thread of their own, a second of samples at a time. A verdict is given `DELAY` after that second, so a live
node and a replay give it with the same sample.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..scene.schema import Scene
from ..types import SECOND, Alarm, Change, Ranked, Stream
from .causes import MEMORY, TEMPER, Evidence, Fault, Hypothesis, Verdict, hypothesis, possible_faults, told

SIZES = 0.4, 0.7, 1.0, 1.4, 1.8  # times the size of a named fault, by which its true size is found
CERTAIN = 3.0  # standard deviations of its size that a named fault has at least
SPACING = 18_000_000  # ns between samples of a stream that fault twins take: 50 Hz tell all that the boom does
SETTLING = 2  # s from a start in which the filters find vibration and zeros
DELAY = 2 * SECOND  # ns after the end of a second, at which its verdict is given


class Follower(Protocol):
    """Interface of a twin as far as fault twins need it; see `boom_twin.Twin`."""

    @property
    def evidence(self) -> float:
        """Log likelihood of all readings."""

    @property
    def requests(self) -> Any:
        """Requested changes that wait for the next stroke sample."""

    def update_block(self, block: Any, /) -> object:
        """Take the samples of a block."""

    def leave_out_as(self, other: Any, /) -> None:
        """Leave out the channels that another twin leaves out."""


class _Second(NamedTuple):
    """Samples of a second that begins at a stamp (ns), or a change before the samples that follow."""

    stamp: int
    block: Any = None
    change: Change | None = None


class FaultTwins:
    """Twins of all fault hypotheses.

    Parameters
    ----------
    scene : Scene
        With its load.
    make : callable
        Hypothesis, whether the health of its sensors is judged -> its twin.
    odds : float
        Posterior probability from which on a cause is named.
    is_live : bool
        True if nobody may wait for a verdict: on a busy processor it is given later than `DELAY`.
    """

    def __init__(
        self, scene: Scene, make: Callable[[Hypothesis, bool], Follower], odds: float = 0.95, is_live: bool = False
    ) -> None:
        self._scene, self._make, self._odds, self._is_live = scene, make, odds, is_live
        self._lasting: dict[str, Alarm] = {}
        self._pending: list[Any] = []
        self._second: int | None = None
        self._taken: dict[tuple[int, int], int] = {}  # stamp of the newest sample taken, by stream and channels
        self._worker = ThreadPoolExecutor(1, "fault twins")
        self._results: deque[tuple[int, Future[list[Alarm]]]] = deque()
        self._recent: deque[_Second] = deque(maxlen=MEMORY)
        self._change: Change | None = None
        self._named: dict[Fault, Alarm] = {}
        self._begin()

    # -- samples in

    def take(self, block: Any) -> None:
        """Take a block of samples, in the order in which the twin takes them."""
        start, seconds = 0, block.stamps // SECOND
        while start < len(seconds):
            if self._second is None:
                self._second = int(seconds[start])
            is_other = (seconds[start:] > self._second) | (seconds[start:] < self._second - 1)
            end = start + int(np.argmax(is_other)) if is_other.any() else len(seconds)
            if end > start:
                self._pending.append(self._thinned(block, slice(start, end)))
            if end < len(seconds):
                self._close()
            start = end

    def change(self, change: Change) -> None:
        """Take a change before the samples that follow."""
        self._close()
        self._hand_over(_Second(change.stamp, change=change))

    def _thinned(self, block: Any, rows: slice) -> Any:
        """Return the samples of part of a block that come at least `SPACING` after the one before of the same channels."""
        streams, stamps, values = block.streams[rows], block.stamps[rows], block.values[rows]
        channels = np.isfinite(values) @ (1 << np.arange(values.shape[1]))
        chosen = list[int]()
        for row, (code, stamp, there) in enumerate(zip(streams.tolist(), stamps.tolist(), channels.tolist(), strict=True)):
            if not 0 <= stamp - self._taken.get((code, there), stamp - SPACING) < SPACING:
                self._taken[code, there] = stamp
                chosen.append(row)
        return block._replace(streams=streams[chosen], stamps=stamps[chosen], values=values[chosen])

    def _close(self) -> None:
        """Give the samples of the last second to the twins."""
        if parts := [part for part in self._pending if len(part.stamps)]:
            columns = zip(*((part.streams, part.stamps, part.values) for part in parts), strict=True)
            streams, stamps, values = map(np.concatenate, columns)
            block = parts[0]._replace(streams=streams, stamps=stamps, values=values)
            self._hand_over(_Second((self._second or 0) * SECOND, block))
        self._pending, self._second = [], None

    def _hand_over(self, second: _Second) -> None:
        self._results.append((second.stamp + SECOND + DELAY, self._worker.submit(self._follow, second)))

    # -- alarms out

    def news(self, stamp: int) -> list[Alarm]:
        """Return the alarms that begin or end, by all seconds that ended `DELAY` before a stamp (ns)."""
        found = list[Alarm]()
        while self._results and self._results[0][0] <= stamp and (not self._is_live or self._results[0][1].done()):
            found += self._results.popleft()[1].result()
        for alarm in found:
            if alarm.until is None:
                self._lasting[str(alarm.cause)] = alarm
            else:
                del self._lasting[str(alarm.cause)]
        return found

    @property
    def alarms(self) -> list[Alarm]:
        """Alarms that last."""
        return list(self._lasting.values())

    # -- in the worker's thread

    def _begin(self) -> None:
        """Make twins of the boom as believed, without each fault that it is known to have, and with each other fault."""
        known = tuple(self._named)
        causes = {fault.cause for fault in known}
        self._faults = [*known, *(fault for fault in possible_faults(self._scene) if fault.cause not in causes)]
        fewer = [tuple(each for each in known if each is not gone) for gone in known]
        more = [(*known, fault) for fault in self._faults[len(known) :]]
        self._hypotheses = [hypothesis(self._scene, faults) for faults in [known, *fewer, *more]]
        self._twins = [self._made(each, place == 0) for place, each in enumerate(self._hypotheses)]
        self._decision, self._evidence, self._age = Evidence(self._faults, self._odds), np.zeros(len(self._twins)), 0

    def _made(self, each: Hypothesis, is_judged: bool) -> Follower:
        twin = self._make(each, is_judged)
        if self._change is not None:
            twin.requests.repeat(_changed(self._change, each))
        return twin

    def _follow(self, second: _Second) -> list[Alarm]:
        """Let all twins take a second or a change; return the alarm that it begins or ends, if any."""
        if second.change is not None:
            self._recent.clear()
            self._change = second.change
            for each, twin in zip(self._hypotheses, self._twins, strict=True):
                twin.requests.repeat(_changed(second.change, each))
            return []
        self._recent.append(second)
        for each, twin in zip(self._hypotheses, self._twins, strict=True):
            twin.leave_out_as(self._twins[0])
            twin.update_block(_in_time(second.block, each))
        before, self._evidence = self._evidence, np.array([twin.evidence for twin in self._twins])
        grown = self._evidence - before
        self._age += 1
        if self._age <= SETTLING:
            return []
        verdict = self._decision.take(second.stamp, grown[1:] - grown[0])
        return [] if verdict is None else self._name(verdict)

    def _name(self, verdict: Verdict) -> list[Alarm]:
        """Believe in a fault, or in the end of one; return its alarm."""
        fault = self._faults[verdict.place]
        if fault in self._named:
            news = [replace(self._named.pop(fault), until=verdict.onset)]
        elif fault.cause == "oil.k":
            self._named[fault], news = Alarm("oil", "softer", verdict.onset, None, fault.cause, ""), []
        else:
            sized, spread = self._sized(fault, verdict.onset)
            if sized.size < CERTAIN * spread:
                self._decision = Evidence(self._faults, self._odds)
                return []
            ranked = tuple(Ranked(cause, chance, ()) for cause, chance in verdict.ranked)
            alarm = Alarm(fault.channel, fault.kind, verdict.onset, None, fault.cause, told(sized, spread), ranked)
            self._named[sized] = alarm
            news = [alarm]
        self._begin()
        return news

    def _sized(self, fault: Fault, onset: int) -> tuple[Fault, float]:
        """Return a fault with its most likely size, and the standard deviation of that, by twins over the recent seconds.

        The logarithm of the likelihood is a parabola through the best of `SIZES` and its neighbours.
        """
        if not fault.size:
            return fault, 0.0
        sizes = np.array(SIZES) * fault.size
        totals = []
        for size in sizes.tolist():
            each = hypothesis(self._scene, (*self._named, fault._replace(size=size)))
            twin = self._made(each, False)
            start = 0.0
            for second in self._recent:
                twin.update_block(_in_time(second.block, each))
                if second.stamp < onset:
                    start = twin.evidence
            totals.append(twin.evidence - start)
        best = min(max(int(np.argmax(totals)), 1), len(sizes) - 2)
        near = slice(best - 1, best + 2)
        curve, slope, _ = np.polyfit(sizes[near] - sizes[best], totals[near], 2)
        if curve >= 0.0:
            return fault._replace(size=float(sizes[int(np.argmax(totals))])), float(sizes[1] - sizes[0])
        size = float(np.clip(sizes[best] - 0.5 * slope / curve, sizes[0], sizes[-1]))
        return fault._replace(size=size), float((-2.0 * TEMPER * curve) ** -0.5)


def _in_time(block: Any, each: Hypothesis) -> Any:
    """Return a block as it comes if streams are as late as a hypothesis says, in the order of time."""
    if not each.delays:
        return block
    stamps = block.stamps.copy()
    for stream, delay in each.delays:
        stamps -= round(delay * SECOND) * (block.streams == list(Stream).index(stream))
    order = np.argsort(stamps, kind="stable")
    return block._replace(streams=block.streams[order], stamps=stamps[order], values=block.values[order])


def _changed(change: Change, each: Hypothesis) -> Change:
    """Return a change with the load that the boom of a hypothesis has then."""
    load = each.load(change.settings["payload"], change.settings["line_fill"])
    return replace(change, settings=change.settings | load)
