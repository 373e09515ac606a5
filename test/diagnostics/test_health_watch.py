"""Alarms of the rig's health on /diagnostics: told, kept after their end, let go when acknowledged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.levels import ComponentJudge, Evaluation, Level, Status
from boom_twin.diagnostics.model_status import INTERVAL, HealthWatch, ResidualWindow, StampWindow
from boom_twin.types import Alarm, Health

SECOND = 1_000_000_000
BIAS = Alarm("joint_3", "bias", 15 * SECOND, None, "joint_3.sensor", "joint_3.sensor bias: +0.0035 rad")
OPEN = Alarm("joint_1", "residual", 16 * SECOND, None, None, "cannot be told apart: cylinder_1.k or joint_1.sensor")


def health(second: int, *alarms: Alarm) -> Health:
    return Health(second * SECOND, alarms, np.zeros(2))


def status(watch: HealthWatch) -> Status:
    return watch.status(ComponentJudge("health").begin(Evaluation(Thresholds(), 0.0, 100.0)))


def test_a_stream_noisier_than_stated_is_one_warning() -> None:
    watch = HealthWatch()
    watch.took(replace(health(1), noise={"noise_over_stroke_sigma": 1.2, "noise_over_angle_sigma": 2.04}))
    found = status(watch)
    assert found.level == Level.WARN and found.values["noise_over_angle_sigma"] == 2.04
    assert found.message == "most sensors of a stream are noisier than its setting states"
    watch.took(health(2))
    assert (status(watch).level, status(watch).message) == (Level.OK, "no alarm")
    assert not watch.has_news and watch.acknowledge() == "no alarm has ended"


def test_an_alarm_that_ended_stays_until_it_is_acknowledged() -> None:
    watch = HealthWatch()
    watch.took(health(17, BIAS, OPEN))
    assert watch.acknowledge() == "no alarm has ended" and status(watch).level == Level.ERROR
    watch.took(health(20, replace(BIAS, until=19 * SECOND), OPEN))
    watch.took(health(21, OPEN))
    found = status(watch)
    assert found.level == Level.WARN and "(ended, not acknowledged)" in found.message
    assert (found.values["alarms"], found.values["not_acknowledged"], found.values["1 to_s"]) == (1, 1, "19.000")
    assert watch.of("joint_3") is None
    assert watch.acknowledge() == BIAS.told
    assert status(watch).message == OPEN.told
    watch.took(health(22, replace(OPEN, kind="softer", cause="cylinder_1.k")))
    assert status(watch).message.startswith("Oil spring of cylinder 1 is softer") and status(watch).level == Level.ERROR


def test_an_alarm_that_comes_and_goes_is_told_once_with_how_often() -> None:
    """A sensor with a loose contact would let the message grow all day."""
    watch = HealthWatch()
    for k in range(8):
        again = replace(BIAS, since=(20 + 2 * k) * SECOND)
        watch.took(health(20 + 2 * k, again, OPEN))
        watch.took(health(21 + 2 * k, OPEN))
    found = status(watch)
    assert found.message.count(BIAS.told) == 1 and "(ended, not acknowledged)" in found.message and found.values["2 times"] == 8
    assert (found.values["alarms"], found.values["not_acknowledged"]) == (1, 8)
    assert len([key for key in found.values if key.endswith(" cause")]) == 2
    watch.took(health(40, replace(BIAS, since=40 * SECOND), OPEN))
    assert watch.of("joint_3") is not None and watch.of("joint_1") is not None
    watch.acknowledge()
    watch.took(health(42, OPEN))
    assert "(ended, not acknowledged)" in status(watch).message


LOAD = "a load at the tip moves the boom"


@pytest.mark.parametrize(
    ("is_judged", "level", "words"),
    [
        (False, Level.ERROR, "larger than noise explains"),
        (True, Level.WARN, "larger than noise explains; health finds no fault in these residuals"),
    ],
)
def test_a_residual_that_is_explained_is_none_and_else_a_warning_at_most_where_health_is_judged(
    is_judged: bool, level: Level, words: str
) -> None:
    window, judge, told = ResidualWindow(0.0), ComponentJudge("residual joint_2"), []
    for second in range(1, 30):
        window.take(np.full(100, 6.0), float(second))
        judge.begin(Evaluation(Thresholds(), float(second), 0.0))
        told.append(window.status(judge, None, LOAD if second < 15 else "", is_judged))
    assert {(each.level, each.message) for each in told[:14]} == {(Level.OK, LOAD)}
    assert told[0].values["rms_normalised"] == 6.0 and (told[-1].level, told[-1].message) == (level, words)


def test_a_window_holds_its_time_and_begins_anew_if_the_clock_is_set_back() -> None:
    window, last = StampWindow(10 * INTERVAL, 1), 200 * INTERVAL
    for stamp in range(0, last + 1, INTERVAL // 4):
        if window.is_due(stamp):
            window.add(stamp, np.array([float(stamp)]))
    assert window.stamps.tolist() == list(range(last - 10 * INTERVAL, last + 1, INTERVAL))
    assert window.is_due(last - INTERVAL)
    window.add(last - INTERVAL, np.zeros(1))
    assert window.stamps.tolist() == [last - INTERVAL]
