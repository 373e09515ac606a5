"""Draw the pictures of replays, booms and studies from arrays. The only package that imports a plotting library, and only when a picture is drawn."""

from __future__ import annotations

from .history import AlarmSpan, History, ImuTrace, Truth
from .session import replay_pictures

__all__ = ["AlarmSpan", "History", "ImuTrace", "Truth", "replay_pictures"]
