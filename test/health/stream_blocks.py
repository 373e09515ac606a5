"""Blocks of readings as the monitor of a stream gets them, with the slow means that go on from block to block."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from boom_twin.health.blocks import BLOCK, MeasuredRows
from boom_twin.health.stream_readings import StreamReadings, StreamSurvey
from boom_twin.types import NANO, Array

_SURVEYS: WeakKeyDictionary[object, StreamSurvey] = WeakKeyDictionary()


def block_of(judge: object, raw: Array, expected: Array, number: int, variance: float = 1.0) -> StreamReadings:
    """Return readings (k, channels), evenly in time, for `judge`, whose blocks before it count in the slow means."""
    count, channels = raw.shape
    survey = _SURVEYS.setdefault(judge, StreamSurvey(variance, channels))
    stamps = number * BLOCK + np.arange(count) * (BLOCK // max(count, 1))
    return survey.take(
        MeasuredRows(stamps, raw, raw - expected, np.full(raw.shape, variance**0.5)),
        np.zeros(channels, dtype=bool),
        BLOCK * NANO,
    )
