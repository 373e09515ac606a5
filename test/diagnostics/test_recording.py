"""What is told of a recording."""

from __future__ import annotations

from math import inf
from typing import Any

import pytest

from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.levels import ComponentJudge, Evaluation, Level, Status
from boom_twin.diagnostics.recorder_status import DiskState, TopicCount, recording_status

TOPICS = [TopicCount("/a", 500, 0, 0), TopicCount("/b", 30, 0, None)]
DISK = {"lag": 0.3, "waiting": 0, "written": 1000, "free": 10**9, "left": inf}


def judged(topics: list[TopicCount] = TOPICS, end: str | None = None, **disk: Any) -> Status:
    """After ten seconds of it."""
    judge, state = ComponentJudge("recording"), DiskState(**(DISK | disk))
    for now in range(10):
        status = recording_status(judge.begin(Evaluation(Thresholds(), float(now), 1e9)), topics, state, end)
    return status


def test_a_healthy_recording() -> None:
    status = judged()
    assert (status.level, status.message) == (Level.OK, "running")
    assert status.values["received /a"] == 500 and status.values["never_arrived /a"] == 0
    assert status.values["never_arrived /b"] == "nan"
    assert judged(end="").message == "ended" and "ended" not in status.values
    assert judged(end="").values["ended"] == judged(end="the disk is full").values["ended"] == 1


@pytest.mark.parametrize(
    ("changes", "level", "words"),
    [
        ({"topics": [TopicCount("/a", 500, 0, 3)]}, Level.WARN, "3 messages were published and never arrived"),
        ({"lag": 3.0}, Level.WARN, "messages of the last 3.0 s are not on the disk yet"),
        ({"lag": 6.0}, Level.ERROR, "messages of the last 6.0 s are not on the disk yet"),
        ({"left": 2000.0}, Level.OK, "running"),
        ({"left": 900.0}, Level.WARN, "the disk is full in 900 s"),
        ({"left": 60.0}, Level.ERROR, "the disk is full in 60 s"),
        ({"left": 0.0}, Level.ERROR, "the disk is full in 0 s"),
        ({"end": "the disk is full"}, Level.ERROR, "the disk is full"),
    ],
)
def test_what_is_wrong_is_told(changes: dict[str, Any], level: Level, words: str) -> None:
    status = judged(**changes)
    assert (status.level, status.message) == (level, words)
