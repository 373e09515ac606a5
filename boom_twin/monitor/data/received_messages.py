"""Count messages that could not be used, by topic, and why the last one."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from typing import Any

from ...system.terminal_text import printable

LOG = logging.getLogger("boom_twin.monitor.data.dropped_messages")
LONGEST = 200
"""Characters of a reason."""


class MalformedError(Exception):
    """Error of a message that cannot be used; the text states why."""


@dataclass(slots=True)
class TopicLoss:
    """Count of the dropped messages of one topic, and the reason of the last one."""

    topic: str
    count: int
    reason: str


class DroppedMessages:
    """Counter and log of dropped messages.

    Every one is handed to the log; how many lines of it are written is bounded there, see `boom_twin.monitor.log_limit`.

    Attributes
    ----------
    by_topic : dict of str to TopicLoss
    """

    def __init__(self) -> None:
        self.by_topic: dict[str, TopicLoss] = {}

    @contextmanager
    def guard(self, topic: str) -> Iterator[None]:
        """Drop and count the message that is taken within, if anything is wrong with it."""
        try:
            yield
        except MalformedError as error:
            self._add(topic, str(error))
        except Exception as error:  # whatever a message holds, the page goes on
            self._add(topic, f"cannot be read: {type(error).__name__}: {error}")

    def told(self) -> list[dict[str, Any]]:
        """Return the losses as plain values, the most messages first."""
        return [asdict(loss) for loss in sorted(self.by_topic.values(), key=lambda loss: -loss.count)]

    def _add(self, topic: str, reason: str) -> None:
        loss = self.by_topic.setdefault(topic, TopicLoss(topic, 0, ""))
        loss.count, loss.reason = loss.count + 1, printable(reason[:LONGEST], keep="")
        LOG.getChild(topic).warning("dropped message %d of %s: %s", loss.count, topic, loss.reason)
