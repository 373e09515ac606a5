"""Levels of reception, of publishers, and of a recording."""

from __future__ import annotations

from math import inf
from typing import Any

import pytest

from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.levels import ComponentJudge, Evaluation, Level, Status
from boom_twin.diagnostics.topic_status import DiskState, Reception, ReceptionWatch, TopicCount, recording_status


def begun(judge: ComponentJudge, now: float = 0.0) -> ComponentJudge:
    return judge.begin(Evaluation(Thresholds(), now, 1e9))


def received(*looks: Reception) -> Status:
    """Return the state after looks that are two seconds apart."""
    watch, judge = ReceptionWatch(), ComponentJudge("reception")
    return [watch.status(begun(judge, 2.0 * k), {"cylinder_strokes": each}) for k, each in enumerate(looks)][-1]


def test_messages_that_never_arrive_give_way_or_wait() -> None:
    well = received(*(Reception(200 * k, 0, 0, 0, 0.001, 0.004) for k in range(4)))
    assert (well.level, well.message) == (Level.OK, "every message is read at once")
    keys = ("received", "wait_s", "latency_s")
    assert [well.values[f"cylinder_strokes {key}"] for key in keys] == [600, 0.001, 0.004]
    some = received(*(Reception(1000 * k, 20 * k, 30 * k, 0, 0.001) for k in range(4)))
    assert some.level == Level.WARN and some.values["cylinder_strokes unread_share"] == pytest.approx(50 / 1020)
    most = received(*(Reception(1000 * k, 0, 900 * k, 4, 0.001) for k in range(4)))
    assert most.level == Level.ERROR and most.values["cylinder_strokes dropped"] == 2700
    slow = received(*(Reception(1000 * k, 0, 0, 100, 0.4) for k in range(4)))
    assert slow.level == Level.WARN and slow.message.startswith("cylinder_strokes: messages wait for their turn")
    anew = received(Reception(1000, 0, 900), Reception(2000, 0, 1800), Reception(10, 0, 0, 0, 0.001))
    assert anew.values["cylinder_strokes unread_share"] == 0.0
    assert "unknown" in str(received(Reception(10, is_numbered=False)).values["cylinder_strokes lost"])


LATE = "messages wait too long to be written to the disk"
TOPICS = [TopicCount("/a", 500, 0, 0), TopicCount("/b", 30, 0, None)]


def recorded(topics: list[TopicCount] = TOPICS, end: str | None = None, **disk: Any) -> Status:
    """Return the state of a recording after ten seconds of it."""
    judge = ComponentJudge("recording")
    state = DiskState(**({"lag": 0.3, "waiting": 0, "written": 1000, "free": 10**9, "left": inf} | disk))
    return [recording_status(begun(judge, float(now)), topics, state, end) for now in range(10)][-1]


@pytest.mark.parametrize(
    ("changes", "level", "words"),
    [
        ({}, Level.OK, "running"),
        ({"end": ""}, Level.OK, "ended"),
        ({"topics": [TopicCount("/a", 500, 0, 3)]}, Level.WARN, "messages were published and never arrived"),
        ({"lag": 3.0}, Level.WARN, LATE),
        ({"lag": 6.0}, Level.ERROR, LATE),
        ({"left": 2000.0}, Level.OK, "running"),
        ({"left": 900.0}, Level.WARN, "the disk will soon be full"),
        ({"left": 0.0}, Level.ERROR, "the disk will soon be full"),
        ({"end": "the disk is full"}, Level.ERROR, "the disk is full"),
    ],
)
def test_what_is_told_of_a_recording(changes: dict[str, Any], level: Level, words: str) -> None:
    status = recorded(**changes)
    assert (status.level, status.message) == (level, words)
    assert status.values.get("ended") == (1 if "end" in changes else None) and status.values["received /a"] == 500
