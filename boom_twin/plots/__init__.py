"""Draw the pictures of replays, booms and studies from arrays. Only this package imports a plotting library, to draw."""

from __future__ import annotations

from .history import AlarmSpan, EstimateTrace, History, ImuTrace, ResidualTrace, Truth
from .session import Painter, painter, replay_pictures

__all__ = [
    "AlarmSpan", "EstimateTrace", "History", "ImuTrace", "Painter", "ResidualTrace", "Truth", "painter", "replay_pictures",
]  # fmt: skip
