"""One line in the log for each start of the model from rest, and each change of what holds."""

from __future__ import annotations

import time

from ..records import Change, Report
from .log import Log

BETWEEN = 1.0
"""Least time (s) between starts that are told: a source whose clock jumps at every sample does not fill the log."""


class Started:
    """Tells what changed.

    Parameters
    ----------
    log : Log
    """

    def __init__(self, log: Log) -> None:
        self._log = log
        self._before: dict[str, float] | None = None
        self._told = -BETWEEN

    def tell(self, report: Report, change: Change) -> None:
        """Log one line on a report that has a change."""
        now = {**change.settings, **{f"zero of {name}": value for name, value in change.zeros.items()}}
        before, self._before = now if self._before is None else self._before, now
        words = [f"{name} {value:g}" for name, value in now.items() if before.get(name) != value]
        if not words and time.monotonic() < self._told + BETWEEN:
            return
        if not report.accepted:
            words.insert(0, f"could not start: {report.status}")
        elif change.from_rest:
            words.insert(0, f"started from rest ({', '.join(report.events) or 'first strokes'})")
        elif "clock set" in report.events:
            words.insert(0, "clock set; the model goes on")
        self._told = time.monotonic()
        self._log.info(f"at {change.stamp // 10**9}.{change.stamp % 10**9:09d}: {'; '.join(words)}")
