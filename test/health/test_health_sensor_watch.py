"""Alarms of single sensors: begun, masked while they last, ended."""

from __future__ import annotations

import math

import numpy as np

from boom_twin import Stream
from boom_twin.health.sensor_check import SensorCheck, SensorFindings
from boom_twin.health.sensor_monitor import AGAIN, SETTLED, SensorMonitor
from boom_twin.texts import alarm_text

from .recorded import look

BLOCK, NAMES = 100_000_000, ("joint_1", "joint_2")


def findings(channel: int | None = None, kind: str = "", jump: float = 0.0, level: float = math.nan) -> SensorFindings:
    found = np.arange(2) == channel
    return SensorFindings({kind: found} if kind else {}, jump * found, np.full(2, level))


class Watched:
    """Takes block after block."""

    def __init__(self) -> None:
        self.watch, self.block = SensorMonitor(NAMES, Stream.ANGLES), 0

    def take(self, found: SensorFindings, newest: np.ndarray | None = None):
        self.block += 1
        return self.watch.take(found, (self.block - 1) * BLOCK, self.block * BLOCK, newest=newest)

    def rest(self, time: int):
        return [alarm for _ in range(time // BLOCK) for alarm in self.take(findings())]


def test_begins_once_lasts_and_ends():
    for kind in ("stuck", "noise", "dropout", "range"):
        watched = Watched()
        assert watched.take(findings()) == [] and watched.watch.alarms == ()
        (began,) = watched.take(findings(1, kind))
        assert (began.channel, began.kind, began.cause) == ("joint_2", kind, "joint_2.sensor")
        assert (began.since, began.until) == (BLOCK, None) and began.told == alarm_text(began.channel, kind, began.cause)
        assert watched.watch.masked.tolist() == [False, True]
        assert [alarm for _ in range(30) for alarm in watched.take(findings(1, kind))] == []
        assert watched.watch.alarms == (began,)
        assert watched.rest(SETTLED) == [] and watched.watch.masked[1]
        (ended,) = watched.rest(BLOCK)
        assert ended.until == 32 * BLOCK and (ended.channel, ended.since) == ("joint_2", BLOCK)
        assert watched.watch.alarms == () and not watched.watch.masked.any()


def test_a_stream_that_falls_silent_has_one_alarm() -> None:
    watched, silent = Watched(), findings()._replace(flags={"dropout": np.ones(2, bool)})
    (began,) = watched.take(silent)
    assert (began.channel, began.kind) == ("joint_angles", "dropout") and "one driver sends them" in began.told
    assert watched.take(silent) == [] and watched.watch.alarms == (began,) and watched.watch.masked.all()
    assert [alarm.channel for alarm in watched.take(findings(1, "dropout"))] == ["joint_2"]
    (ended,) = [alarm for _ in range(SETTLED // BLOCK) for alarm in watched.take(findings(1, "dropout"))]
    assert ended.channel == "joint_angles" and watched.watch.masked.tolist() == [False, True]
    assert [alarm.channel for alarm in watched.take(silent)] == ["joint_1"]  # one sensor had failed before by itself


def test_nothing_is_found_of_a_sensor_that_is_not_there():
    watch = SensorMonitor(NAMES, Stream.ANGLES, absent={NAMES[1]})
    assert watch.take(findings(1, "dropout"), 0, BLOCK) == [] and not watch.masked.any()


def test_a_jump_lasts_until_it_jumps_back():
    watched = Watched()
    (began,) = watched.take(findings(0, "jump", 0.01))
    assert began.evidence == "+0.573 deg" and watched.watch.masked.tolist() == [True, False]
    assert watched.rest(5 * SETTLED) == [] and watched.watch.masked[0]
    assert watched.take(findings(0, "jump", 0.02)) == [], "further away"
    watched.rest(SETTLED)
    (ended,) = watched.take(findings(0, "jump", -0.0099))
    assert ended.until == watched.block * BLOCK and watched.watch.alarms == ()


def test_a_jump_ends_where_readings_are_right_for_two_seconds_without_a_jump_back():
    """As of an encoder that slipped while a looped bag began anew."""
    watched = Watched()
    watched.take(findings(0, "jump", 0.01, level=0.0102))
    off, right = np.array([0.0099, 0.0]), np.array([-0.0001, 0.0])
    assert [alarm for _ in range(50) for alarm in watched.take(findings(), off)] == [] and watched.watch.masked[0]
    told = [alarm for _ in range(SETTLED // BLOCK + 1) for alarm in watched.take(findings(), right)]
    assert [alarm.kind for alarm in told] == ["jump"] and not watched.watch.masked.any()


def test_a_frozen_sensor_that_lives_again_is_taken_back():
    """It jumps from where it was frozen to where the boom has gone meanwhile."""
    watched = Watched()
    watched.take(findings(0, "stuck"))
    watched.rest(SETTLED // 2)
    assert watched.take(findings(0, "jump", 0.05, level=0.0)) == []
    (ended,) = watched.rest(SETTLED)
    assert ended.kind == "stuck" and not watched.watch.masked.any()


def test_a_jump_ends_where_the_reading_is_right_again():
    """After a jump to a reading that repeats: the boom has moved when it comes back, so the steps are of different size."""
    watched = Watched()
    watched.take(findings(0, "jump", -0.5, level=-0.501))
    watched.take(findings(0, "stuck"))
    watched.rest(SETTLED // 2)
    (ended,) = watched.take(findings(0, "jump", 0.8, level=0.002))
    assert ended.kind == "jump"
    assert [alarm.kind for alarm in watched.rest(SETTLED)] == ["stuck"] and not watched.watch.masked.any()
    watched.take(findings(0, "jump", -0.5, level=-0.501))
    watched.rest(SETTLED)
    assert watched.take(findings(0, "jump", 0.8, level=0.299)) == [], "elsewhere, but not right"


def jumped_after_a_pause(seconds: float, expected: float = 0.0, read: float = 0.1) -> float:
    """What a check finds of a reading that is 0.1 rad further for good, so long after the one before it.

    The expected reading is further by `expected`.
    """
    check = SensorCheck(2e-4, 1e-4, np.array([-3.0]), np.array([3.0]), 0.0)
    noise, times, number = np.random.default_rng(1).normal(0.0, 2e-4, (40, 1)), 0.005 * np.arange(20), round(seconds / 0.1) + 1
    assert not look(check, 0, times, noise[:20]).jumped.any()
    return float(look(check, number, 0.095 + seconds + times, read + noise[20:], expected).jumped[0])


def test_a_jump_from_one_reading_to_the_next_is_found_and_none_across_a_gap():
    """While nothing came the boom may have moved, and the model did not see it."""
    assert abs(jumped_after_a_pause(0.005) - 0.1) < 2e-3
    assert jumped_after_a_pause(4.005) == 0.0


def test_readings_that_lag_all_at_once_are_no_jump():
    """In 0.2 s the boom turns by 0.1 rad; the readings go on from where they were, for from then on they are 0.2 s late."""
    assert jumped_after_a_pause(0.205, expected=0.1, read=0.005) == 0.0
    assert abs(jumped_after_a_pause(0.205, expected=0.1, read=0.3) - 0.2) < 2e-3


def test_an_intermittent_contact_is_one_alarm_with_a_count():
    """A sensor that fails again within a minute; of its further failures no other alarm is told. It ends after a minute."""
    watched, told = Watched(), []
    for kind in ["dropout", "range", "dropout", "stuck"]:
        told += watched.take(findings(0, kind)) + watched.take(findings(0, "noise"))
        assert watched.watch.masked[0]
        told += watched.rest(5 * SETTLED)
        assert not watched.watch.masked.any()
    again = [alarm for alarm in told if alarm.kind == "intermittent"]
    assert {(alarm.kind, alarm.since) for alarm in told if alarm not in again} == {("dropout", 0), ("noise", BLOCK)}
    assert [alarm.evidence.partition("x")[0] for alarm in again] == ["2", "3", "4"] and len(
        {alarm.since for alarm in again}
    ) == 1
    assert watched.watch.alarms == (again[-1],)
    (ended,) = watched.rest(AGAIN)
    assert ended.kind == "intermittent" and ended.until is not None and watched.watch.alarms == ()
