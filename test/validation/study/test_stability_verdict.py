"""Verdicts of the stability study on made-up data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from boom_twin.validation.study.stability.verdict import (
    BOUNDS,
    Facts,
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


# -- facts ------------------------------------------------------------------------------------------------------------
