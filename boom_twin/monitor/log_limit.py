"""Limit the rate of the monitor's log lines, so that nobody outside can cause a flood of them."""

from __future__ import annotations

import logging
import sys
import time

PERIOD = 10.0
"""Seconds."""
MAX_RECORDS = 3
"""Records of one logger written in a `PERIOD`."""


class LogRateLimit(logging.Filter):
    """Filter that passes `MAX_RECORDS` records of each logger in a `PERIOD`.

    The first record after the period states how many were left out.
    """

    def __init__(self) -> None:
        super().__init__()
        self._periods: dict[str, tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Return True if the record is to be written."""
        now = time.monotonic()
        begin, count = self._periods.get(record.name, (now, 0))
        if now - begin >= PERIOD:
            if count > MAX_RECORDS:
                record.msg, record.args = f"{record.getMessage()} ({count - MAX_RECORDS} lines before this were left out)", None
            begin, count = now, 0
        self._periods[record.name] = begin, count + 1
        return count < MAX_RECORDS


def write_log() -> None:
    """Write warnings of all loggers of this process to its standard error, at the rate of `LogRateLimit`."""
    handler = logging.StreamHandler(sys.stderr)
    handler.addFilter(LogRateLimit())
    logging.basicConfig(level=logging.WARNING, format="%(message)s", handlers=[handler])
