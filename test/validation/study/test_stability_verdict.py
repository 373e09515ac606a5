"""Verdicts of the stability study on made-up data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from boom_twin.analysis.methods import MethodRun
from boom_twin.validation.study.stability.verdict import (
    BOUNDS,
    Facts,
    against_motion,
    against_rest,
    alternating,
    growth,
)

GOOD = Facts("ok", error=1e-4, acceleration=1e-3, force=1e-3, ringing=0.0, force_ringing=0.0, growth=1.0, drift=0.0, passes=1.0)


@pytest.mark.parametrize("name", BOUNDS)
def test_each_quantity_has_its_bounds(name):
    low, high, symptom = BOUNDS[name]
    holds, degrades = (replace(GOOD, **{name: share * low}).verdict for share in (0.99, 1.01))
    assert (holds.word, holds.symptom) == ("holds", "")
    assert degrades.word == "degrades" and not degrades.silent
    assert degrades.symptom.startswith(symptom.split("{")[0])
    if np.isfinite(high):
        failed = replace(GOOD, **{name: 1.01 * high}).verdict
        assert failed.word == "fails" and failed.silent


@pytest.mark.parametrize(
    ("facts", "word", "silent", "symptom"),
    [
        (Facts("the equations did not converge"), "fails", False, "the equations did not converge"),
        (replace(GOOD, error=0.5, doubt="the step is coarse"), "fails", False, "(it says: the step is coarse)"),
        (Facts("no equilibrium", solvable=False), "refuses", False, ""),
        (Facts("ok", solvable=False), "fails", True, ""),
        (replace(GOOD, error=np.inf), "fails", True, ""),
        (replace(GOOD, drift=np.nan), "holds", False, ""),
        (replace(GOOD, error=0.02, growth=50.0), "fails", True, "vibration grows 50-fold"),
    ],
)
def test_a_failure_is_silent_unless_the_solver_says_so(facts, word, silent, symptom):
    found = facts.verdict
    assert (found.word, found.silent) == (word, silent) and symptom in found.symptom


# -- facts ------------------------------------------------------------------------------------------------------------


def made_up(step=1e-2, duration=4.0, growing=0.0, ring=0.0, shift=0.0):
    """A tip that vibrates at 1 Hz by 0.1 m, after a shift; `growing` (1/s), alternating acceleration `ring` (m/s^2)."""
    times = step * np.arange(round(duration / step) + 1)
    wave = 0.1 * np.exp(growing * times) * np.cos(2 * np.pi * times)
    signs = ring * (-1.0) ** np.arange(len(times))
    tip = np.stack([wave + shift, 0.0 * wave], axis=1)
    acceleration = np.stack([-((2 * np.pi) ** 2) * wave + signs, 0.0 * wave], axis=1)
    forces = np.full((len(times), 2), 1e4)
    no_pins = np.zeros((len(times), 0, 4))
    return MethodRun(times, tip, acceleration, forces * 0.0, forces, no_pins, 1.0, len(times) - 1, 1.5, "ok")


def test_error_is_a_share_of_the_path():
    facts = against_motion(made_up(), made_up(), 1.0)
    assert (facts.error, facts.acceleration, facts.force, facts.ringing) == (0.0, 0.0, 0.0, 0.0)
    assert facts.growth == pytest.approx(1.0) and facts.passes == 1.5
    assert against_motion(made_up(shift=0.01), made_up(), 1.0).error == pytest.approx(0.05)


def test_ringing_is_what_changes_sign_from_row_to_row():
    facts = against_motion(made_up(ring=2.0), made_up(), 1.0)
    assert facts.ringing == pytest.approx(2.0 / (0.1 * (2 * np.pi) ** 2), rel=1e-3)
    times = np.linspace(0.0, 1.0, 101)[:, None]
    assert np.abs(alternating(np.sin(2 * np.pi * times))).max() < 1.1e-3
    assert alternating((-1.0) ** np.arange(5)[:, None])[:, 0] == pytest.approx([-1, 1, -1])


def test_growth_compares_last_quarter_with_first():
    assert growth(made_up(growing=0.5), 0.0) == pytest.approx(np.exp(0.5 * 3.0), rel=1e-2)
    assert against_motion(made_up(growing=-0.5), made_up(growing=-0.5), 0.0).growth == pytest.approx(1.0)
    assert against_rest(made_up(growing=0.5), None, 0.0).growth > 3.0


def test_drift_is_from_the_equilibrium_or_of_the_mean():
    calm = made_up(growing=-30.0)
    assert against_rest(calm, np.array([1e-3, 0.0]), 0.0).drift == pytest.approx(1e-2, rel=1e-3)
    assert against_rest(made_up(), None, 0.0).drift < 1e-6
