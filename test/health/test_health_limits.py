"""What a load at the tip leaves to be told: figures from the posterior's covariance, against faults of that size."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from drive_twin import PUMP_DRIVES, drive_twin
from health.recorded import Outcome, run, session

from boom_twin import load_scene
from boom_twin.health.alarm_text import limits_as_text
from boom_twin.health.baseline import Baseline
from boom_twin.health.inference.fault_catalogue import parameters
from boom_twin.health.inference.hypotheses import Evidence, HypothesisTest
from boom_twin.scene.edit import parameter, with_parameters

KEY, SPAN = "told_from_cylinder_2.k", 36.0


@lru_cache
def shaken(softer: float) -> Outcome:
    """The bundled session with a pump; its cylinder 2 is softer than the twin's scene has it."""
    scene = load_scene()
    stiff = with_parameters(scene, {"cylinder_2.k": parameter(scene, "cylinder_2.k") / (1.0 - softer)})
    return run(session(SPAN, PUMP_DRIVES), twin=drive_twin(stiff, baseline=Baseline()))


def limits() -> list[float]:
    """From the healthy session, as they changed."""
    return [float(health.noise[KEY]) for health in shaken(0.0).health if KEY in health.noise]


def test_a_fault_above_the_figure_is_told_and_one_below_is_not() -> None:
    low, high = min(limits()), max(limits())
    assert 0.02 < low < high < 0.15, "another posture, another figure"
    assert not shaken(0.0).told() and not shaken(0.6 * high).told()
    told = shaken(1.6 * high).told()
    assert told and told[0][0] < SPAN


def test_it_is_said_only_of_a_boom_that_is_shaken() -> None:
    quiet = run(session())
    assert all(KEY not in health.noise for health in quiet.health) and not limits_as_text(quiet.health[-1].noise)
    (told,) = limits_as_text(shaken(0.0).health[-1].noise)
    assert "shakes the tip" in told and f"cylinder_2.k from {100 * limits()[-1]:.0f} %" in told


@pytest.mark.parametrize("size", [0.05, 0.4])
def test_the_least_size_is_where_the_log_factor_is_that_wanted(size) -> None:
    """A fault of exactly that size, without noise, has it."""
    known = parameters(load_scene())
    test, count = HypothesisTest(known), len(known)
    place = next(i for i, each in enumerate(known) if each.cause == "cylinder_2.k")
    information = np.zeros(count)
    information[place] = 90.0 / size**2
    wanted = 15.0
    least = test.least_told(information, wanted)
    matrix, vector = np.zeros((1, 2 * count, 2 * count)), np.zeros((1, 2 * count))
    matrix[0, place, place], vector[0, place] = information[place], information[place] * least[place]
    evidence = Evidence(matrix, vector, np.zeros(1), 1.0, np.zeros(1))
    verdict = test.explain(evidence, np.zeros(0), np.zeros((0, 0)), 5.0, {})
    assert verdict.best.log_factor == pytest.approx(wanted, abs=1.0)  # and what it adds that k has a least value
    others = [i for i, each in enumerate(known) if each.faulty == 0.0]
    assert np.isinf(least[others]).all()
