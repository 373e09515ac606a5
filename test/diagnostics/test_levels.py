"""Levels with hysteresis in value and time; the status of one component."""

from __future__ import annotations

from math import inf, nan

import pytest

from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.levels import Bounds, ComponentJudge, Evaluation, Hysteresis, Level

BOUNDS, SLOW = Bounds(warn=1.0, error=2.0), Thresholds(raise_after=2.0, clear_after=5.0, release=0.8)
AT_ONCE = Thresholds(raise_after=0.0, clear_after=0.0, release=0.8)
LOW = Bounds(warn=100.0, error=10.0, low=True)


@pytest.mark.parametrize(
    ("values", "expected", "bounds", "thresholds"),
    [
        ([0, 1.5, 0, 1.5, 0], "OOOOO", BOUNDS, SLOW),  # too short
        ([0, 1.5, 1.5, 1.5, 1.5], "OOWWW", BOUNDS, SLOW),
        ([0, 2.5, 2.5, 2.5, 1.7, 1.7], "OOEEEE", BOUNDS, SLOW),  # not below 0.8 of the limit
        ([0, 2.5, 2.5, 1.5, 1.5, 1.5, 1.5, 1.5], "OOEEEEEW", BOUNDS, SLOW),
        ([0, 1.5, 1.5, 0.9, 0.9, 0.9, 0.9, 0.9], "OOWWWWWW", BOUNDS, SLOW),
        ([0, 1.5, 1.5, 0, 0, 1.5, 0, 0, 0, 0, 0], "OOWWWWWWWWO", BOUNDS, SLOW),
        ([nan, nan, nan], "OOO", BOUNDS, SLOW),
        ([0, 1.5, 2.5, 0], "OWEO", BOUNDS, AT_ONCE),
        ([inf, 101.0, 99.0, 9.0, 11.0, 13.0, 120.0, 126.0], "OOWEEWWO", LOW, AT_ONCE),
    ],
)
def test_a_level_must_last(values: list[float], expected: str, bounds: Bounds, thresholds: Thresholds) -> None:
    """First letters of the levels at one value a second."""
    judge = Hysteresis()
    found = [judge.update(value, bounds, thresholds, float(now)) for now, value in enumerate(values)]
    assert "".join(level.name[0] for level in found) == expected


def test_a_status_tells_value_limit_and_since_when() -> None:
    judge = ComponentJudge("pump")

    def look(now: float, value: float) -> tuple[Level, str, dict[str, object]]:
        judge.begin(Evaluation(AT_ONCE, now, 1000.0 + now))
        judge.check("heat_K", value, Bounds(300.0, 400.0), f"{value:g} K is hot")
        judge.note({"colour": "red"})
        status = judge.finish("cool")
        return status.level, status.message, dict(status.values)

    told = {"heat_K": 350.0, "heat_K_warn": 300.0, "heat_K_error": 400.0, "colour": "red", "since_s": "1000.000"}
    assert look(0.0, 350.0) == look(1.0, 350.0) == (Level.WARN, "350 K is hot", told)
    assert look(2.0, 450.0) == (Level.ERROR, "450 K is hot", told | {"heat_K": 450.0, "since_s": "1002.000"})
    assert look(3.0, 20.0) == (Level.OK, "cool", told | {"heat_K": 20.0, "since_s": "1003.000"})


def test_the_worst_fault_is_told_first_in_the_words_that_were_true_last() -> None:
    judge, found = ComponentJudge("pump"), []
    for now, value, age, words in ((0.0, 5.0, 5.0, ("first", "second")), (1.0, 0.5, 0.5, ("not true", "not true"))):
        judge.begin(Evaluation(Thresholds(), now, now))
        judge.check("a", value, Bounds(warn=1.0), words[0], at_once=True)
        judge.check_age(age, words[1])
        status = judge.finish("well")
        found.append((status.level, status.message))
    assert found == [(Level.STALE, "second; first"), (Level.WARN, "first")]
