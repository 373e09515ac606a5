"""Buffer between a twin and its fault twins: collects seconds of samples, and returns the alarms when they are due.

Fault twins take a second of samples at a time. They run in a thread of a replay, or in a process beside a live node, so that
samples of the rig do not wait for them. A verdict is given `DELAY` after its second, with the same sample in node and replay.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property
from typing import Any

import numpy as np

from ..config.settings import Settings
from ..scene.schema import Scene
from ..system.child_call import ChildCall, ChildEndedError
from ..system.processes import usable_cores
from ..types import SECOND, Alarm, Change, StrokeReading
from .causes import MEMORY
from .fault_search import DELAY, FaultSearch
from .faults import Follower, Hypothesis, Second
from .sensor_check import Flags

SPACING = 18_000_000  # ns, least time between samples of a stream: 50 Hz suffice for all motion of the boom


class FaultTwins:
    """Buffer of samples of each second for a `FaultSearch`, and of its alarms until they are due.

    `is_live`: the search runs in one thread of another process, and the caller does not wait. On a busy processor verdicts
    then come later than `DELAY`. While `MEMORY` seconds wait, further seconds are left out. Other parameters: see
    `FaultSearch`.
    """

    def __init__(
        self,
        scene: Scene,
        make: Callable[[Hypothesis], Follower],
        settings: Settings,
        is_live: bool = False,
        reads: StrokeReading = StrokeReading.LENGTH,
    ) -> None:
        self._given, self._is_live = (scene, make, settings, reads, 1 if is_live else usable_cores()), is_live
        self._lasting: dict[str, Alarm] = {}
        self._pending: list[Any] = []
        self._second = 0  # whole seconds of the pending samples' stamps
        self._left_out: tuple[Flags, Flags] | None = None
        self._taken: dict[tuple[int, bytes], int] = {}  # stamp of the newest sample taken, by stream and channels
        self._worker = ThreadPoolExecutor(1, "fault twins")
        self._results: deque[tuple[int, Future[list[Alarm]]]] = deque()

    def begin(self) -> None:
        """Begin to make the twins."""
        self._worker.submit(lambda: self._search)

    def close(self) -> None:
        """End the threads, and the process of a live node, also while they work."""
        self._end_search()
        self._worker.shutdown(cancel_futures=True)
        self._end_search()  # one that was started meanwhile

    def _end_search(self) -> None:
        if (search := vars(self).get("_search")) is not None:
            search.close()

    @cached_property
    def _search(self) -> ChildCall | FaultSearch:
        return ChildCall(FaultSearch, *self._given) if self._is_live else FaultSearch(*self._given)

    # -- samples in

    def reach(self, stamp: int, left_out: Callable[[], tuple[Flags, Flags]]) -> None:
        """Note the stamp (ns) of the next sample. If a second ends there, get the channels that are left out now."""
        second = stamp // SECOND
        if self._pending and not self._second - 1 <= second <= self._second:
            self._left_out = left_out()
            self._close()
        if not self._pending:
            self._second = second

    def take(self, block: Any, channels: bytes = b"") -> None:
        """Take samples of one second, in the order in which the twin takes them; keep those that `wants` accepts.

        `channels` is a key of those with a value in all these samples; empty if none is missing.
        """
        chosen = list[int]()
        for row, (code, stamp) in enumerate(zip(block.streams.tolist(), block.stamps.tolist(), strict=True)):
            if self.wants(code, stamp, channels):
                self._taken[code, channels] = stamp
                chosen.append(row)
        self._pending.append(block._make(column[chosen] for column in block))

    def wants(self, code: int, stamp: int, channels: bytes = b"") -> bool:
        """Return True if a sample is at least `SPACING` after the last taken one of the same stream and channels."""
        return not 0 <= stamp - self._taken.get((code, channels), stamp - SPACING) < SPACING

    def change(self, change: Change) -> None:
        """Take a change before the samples that follow."""
        self._close()
        self._hand_over(Second(change.stamp, change=change))

    def _close(self) -> None:
        """Hand the pending samples to the twins."""
        parts = [part for part in self._pending if len(part.stamps)]
        if parts and not (self._is_live and len(self._results) >= MEMORY):
            block = parts[0]._make(map(np.concatenate, zip(*parts, strict=True)))
            self._hand_over(Second(self._second * SECOND, block, self._left_out))
        self._pending = []

    def _hand_over(self, second: Second) -> None:
        self._results.append((second.stamp + (1 + DELAY) * SECOND, self._worker.submit(self._followed, second)))

    def _followed(self, second: Second) -> list[Alarm]:
        """Let the search follow a second; begin another one if its process has been ended, such as for want of memory."""
        try:
            return self._search(second)
        except ChildEndedError:
            vars(self).pop("_search", None)
            return []

    # -- alarms out

    def news(self, stamp: int) -> list[Alarm]:
        """Return alarms that begin or end, by the seconds whose verdicts are due at a stamp (ns)."""
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
