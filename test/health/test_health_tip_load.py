"""An unknown load at the tip stays plausible: above its limit it is an alarm, and so is what no load explains."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from health.recorded import Outcome, run

from boom_twin import Sample, load_scene
from boom_twin.bag.session_files import samples_of
from boom_twin.health.tip_load import AFTER, OVER, TipLoadMonitor
from boom_twin.scene.kinematics import joint_angles_of_strokes, strokes_of_posture
from boom_twin.types import SECOND

RATE, SECONDS = 100.0, 10.0
STROKES = strokes_of_posture(load_scene(), "arch")


@lru_cache
def deflection() -> np.ndarray:
    """Of the joints at rest, as the twin predicts it, rad: -3 to -21 mrad."""
    return run(session_without(0.0)).reports[0].prediction.joints - joint_angles_of_strokes(load_scene(), STROKES)


def session_without(share: float, imu: bool = False, deflected: np.ndarray | None = None) -> list[Sample]:
    """A boom at rest whose angles lack a share of its deflection; its IMU reads gravity in the frame of the base."""
    random, scene, count = np.random.default_rng(1), load_scene(), int(RATE * SECONDS)
    angles = joint_angles_of_strokes(scene, STROKES) + (0.0 if deflected is None else (1.0 - share) * deflected)
    force = np.array([0.0, 9.81]) + random.normal(0.0, 0.05, (count, 2))
    stamps = 10**18 + (np.arange(count) * SECOND / RATE).astype(np.int64)
    rows = [values + random.normal(0.0, sigma, (count, 4)) for values, sigma in ((STROKES, 2e-5), (angles, 1.7e-4))]
    return samples_of(stamps, *rows, force if imu else None, stamps, None)


@lru_cache
def without_deflection(share: float, imu: bool) -> Outcome:
    return run(session_without(share, imu, deflection()))


@pytest.mark.parametrize("share, imu", [(1.0, True), (1.0, False), (0.4, False)])
def test_a_deviation_that_no_plausible_load_explains_is_told_within_5_s_and_lasts(share, imu):
    outcome = without_deflection(share, imu)
    told = outcome.told()
    assert told and told[0][0] < 5.0
    assert outcome.causes() == ({"tip_imu.sensor"} if imu else set()), "no part of the boom is to blame, and the IMU is askew"
    assert all(health.alarms for health in outcome.health if (health.stamp - outcome.start) / SECOND > 5.0)
    assert all(alarm.until is None for _, alarm in outcome.states())


def test_a_load_above_its_limit_is_an_alarm_with_size_deviation_and_remedy():
    monitor = TipLoadMonitor(500.0)
    assert monitor.take(7 * SECOND, 800.0, 50.0) == []
    (alarm,) = monitor.take(10 * SECOND, 700.0, 40.0)
    assert (alarm.cause, alarm.kind, alarm.since, alarm.until) == ("tip.load", "exceeded", 7 * SECOND, None)
    assert alarm.ranked[0].parts == (("exceeded", 800.0, 50.0, "N"),)
    assert "800 +- 50 N at the tip, above the limit of 500 N (tip_load_limit); stop the pump" in alarm.told


def test_a_load_is_told_from_its_second_passing_of_the_limit_on_until_it_stays_away():
    monitor, news = TipLoadMonitor(500.0), {}
    for tenth in range(300):
        time = 0.1 * tenth
        size = 900.0 if 5.0 <= time < 15.0 and time % 2.5 < 0.25 else 100.0  # pulses
        for alarm in monitor.take(tenth * SECOND // 10, size, 50.0):
            news[tenth] = alarm
    first, last = min(news), max(news)
    assert 50 + 10 * AFTER <= first <= 50 + 10 * (AFTER + 2.5) and news[first].since == 5 * SECOND
    assert news[last].until == last * SECOND // 10 and last == pytest.approx(127 + 10 * OVER, abs=2) and monitor.alarm is None


@pytest.mark.parametrize("size, sigma", [(499.0, 1.0), (600.0, 40.0)])
def test_a_load_that_is_not_surely_above_its_limit_is_none(size, sigma):
    monitor = TipLoadMonitor(500.0)
    assert [monitor.take(second * SECOND, size, sigma) for second in range(60)] == [[]] * 60
