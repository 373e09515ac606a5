"""Levels with hysteresis in value and time."""

from __future__ import annotations

from math import inf, nan

import pytest

from boom_twin.config.settings import Thresholds
from boom_twin.diagnostics.levels import Bounds, ComponentJudge, Evaluation, Hysteresis, Level

BOUNDS, THRESHOLDS = Bounds(warn=1.0, error=2.0), Thresholds(raise_after=2.0, clear_after=5.0, release=0.8)


def levels(values: list[float], thresholds: Thresholds = THRESHOLDS) -> str:
    """First letters of the levels at one value a second."""
    judge = Hysteresis()
    return "".join(judge.update(value, BOUNDS, thresholds, float(now)).name[0] for now, value in enumerate(values))


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([0, 1.5, 0, 1.5, 0], "OOOOO"),  # too short
        ([0, 1.5, 1.5, 1.5, 1.5], "OOWWW"),
        ([0, 2.5, 2.5, 2.5, 1.7, 1.7], "OOEEEE"),  # not below 0.8 of the limit
        ([0, 2.5, 2.5, 1.5, 1.5, 1.5, 1.5, 1.5], "OOEEEEEW"),
        ([0, 1.5, 1.5, 0.9, 0.9, 0.9, 0.9, 0.9], "OOWWWWWW"),
        ([0, 1.5, 1.5, 0, 0, 0, 0, 0], "OOWWWWWO"),
        ([0, 1.5, 1.5, 0, 0, 1.5, 0, 0, 0, 0, 0], "OOWWWWWWWWO"),
        ([nan, nan, nan], "OOO"),
    ],
)
def test_a_level_must_last(values: list[float], expected: str) -> None:
    assert levels(values) == expected


NONE = Thresholds(raise_after=0.0, clear_after=0.0, release=0.8)


def test_without_patience_a_level_counts_at_once() -> None:
    assert levels([0, 1.5, 2.5, 0], NONE) == "OWEO"


def test_a_quantity_of_which_little_is_bad() -> None:
    judge, bounds = Hysteresis(), Bounds(warn=100.0, error=10.0, low=True)
    values = [inf, 101.0, 99.0, 9.0, 11.0, 13.0, 120.0, 126.0]
    assert "".join(judge.update(value, bounds, NONE, 0.0).name[0] for value in values) == "OOWEEWWO"


def test_a_status_tells_value_limit_and_since_when() -> None:
    judge, thresholds = ComponentJudge("pump"), Thresholds(raise_after=0.0, clear_after=0.0)

    def look(now: float, value: float) -> tuple[Level, str, dict[str, object]]:
        judge.begin(Evaluation(thresholds, now, 1000.0 + now))
        judge.check("heat_K", value, Bounds(300.0, 400.0), f"{value:g} K is hot")
        judge.note({"colour": "red"})
        status = judge.finish("cool")
        return status.level, status.message, dict(status.values)

    told = {"heat_K": 350.0, "heat_K_warn": 300.0, "heat_K_error": 400.0, "colour": "red", "since_s": "1000.000"}
    assert look(0.0, 350.0) == (Level.WARN, "350 K is hot", told)
    assert look(1.0, 350.0) == (Level.WARN, "350 K is hot", told)
    assert look(2.0, 450.0) == (Level.ERROR, "450 K is hot", told | {"heat_K": 450.0, "since_s": "1002.000"})
    assert look(3.0, 20.0) == (Level.OK, "cool", told | {"heat_K": 20.0, "since_s": "1003.000"})


def test_the_worst_fault_is_told_first() -> None:
    judge = ComponentJudge("pump")
    judge.begin(Evaluation(Thresholds(), 0.0, 0.0))
    judge.check("a", 5.0, Bounds(warn=1.0), "first", at_once=True)
    judge.check_age(5.0, "second")
    status = judge.finish("well")
    assert (status.level, status.message) == (Level.STALE, "second; first")
    judge.begin(Evaluation(Thresholds(), 1.0, 1.0))
    judge.check("a", 0.5, Bounds(warn=1.0), "not true any more", at_once=True)
    judge.check_age(0.5, "not true any more")
    status = judge.finish("well")
    assert (status.level, status.message) == (Level.WARN, "first")
