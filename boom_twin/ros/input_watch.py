"""Whether an input topic is alive, and how fast it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus

from ..io.topics import Topic

SILENT = 2.0  # s by the node's clock after which an input is stale


@dataclass
class InputWatch:
    """What came by one topic; times in s by the node's clock, stamps in ns."""

    topic: Topic
    count: int = 0
    newest: int | None = None
    heard: float = 0.0  # last, or when listening began
    rate: float = 0.0
    _looked: int = 0
    _told: int = 0

    def begin(self, now: float) -> None:
        """Listening begins."""
        self.heard, self.newest = now, None

    def seen(self, stamp: int) -> None:
        """A message came."""
        self.count += 1
        self.newest = stamp

    def look(self, now: float) -> None:
        """Notice whether anything has come since the last look."""
        if self.count != self._looked:
            self._looked, self.heard = self.count, now

    def count_rate(self, span: float) -> None:
        """Messages a second since this was called last, `span` s ago."""
        self.rate = (self.count - self._told) / span if span > 0.0 else 0.0
        self._told = self.count

    def is_silent(self, now: float) -> bool:
        """Whether nothing has come for too long."""
        return now - self.heard > SILENT

    def judge(self, active: bool, now: float) -> tuple[bytes, str]:
        """Level and message."""
        if not active:
            return DiagnosticStatus.OK, "not listened to"
        if not self.is_silent(now):
            return DiagnosticStatus.OK, "listened to"
        if self.newest is None and not self.topic.required:
            return DiagnosticStatus.OK, "not there; optional"
        never = self.newest is None
        return DiagnosticStatus.STALE, "nothing received yet" if never else f"silent for more than {SILENT:g} s"

    def values(self) -> dict[str, Any]:
        """What is told beside them."""
        return {"messages": self.count, "rate (Hz)": f"{self.rate:.1f}", "newest stamp": seconds(self.newest)}


def seconds(stamp: int | None) -> str:
    """A stamp in seconds, exactly."""
    return "none" if stamp is None else f"{stamp // 1_000_000_000}.{stamp % 1_000_000_000:09d}"
