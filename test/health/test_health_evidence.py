"""What is compiled of the evidence of faults, against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.health.inference.hypotheses import Evidence
from boom_twin.types import Array

COUNT, HEALTHY, LEVELS = 9, 5, 3


def white(seed: int, rows: int = 40) -> Array:
    scales = 10.0 ** np.linspace(-2.0, 2.0, 1 + COUNT)
    return np.random.default_rng(seed).normal(size=(LEVELS, rows, 1 + COUNT)) * scales


def covariance_of_rank(rank: int) -> Array:
    """Of the healthy parameters, some without any deviation."""
    root = np.random.default_rng(rank).normal(size=(HEALTHY, rank))
    root[1] = 0.0
    return root @ root.T


def integrated_out(evidence: Evidence, mean: Array, covariance: Array) -> Evidence:
    """L (I + P L)^-1 and (I + L P)^-1 (l - L m), as they stand in the module."""
    k = len(mean)
    wide = np.zeros((COUNT, COUNT))
    wide[:k, :k] = covariance
    shift = np.concatenate([mean, np.zeros(COUNT - k)])
    inverse = np.linalg.inv(np.eye(COUNT) + evidence.matrix @ wide)
    off = evidence.vector - evidence.matrix @ shift
    vector = (inverse @ off[..., None])[..., 0]
    fitted = (evidence.vector + off) @ shift + ((off @ wide)[..., None, :] @ vector[..., None])[..., 0, 0]
    log_det = np.linalg.slogdet(np.eye(COUNT) + evidence.matrix @ wide)[1]
    log = evidence.log + 0.5 * (fitted - log_det)
    return Evidence(inverse @ evidence.matrix, vector, evidence.squares - fitted, evidence.rows, log)


@pytest.mark.parametrize("rank", [0, 2, 4])
@pytest.mark.parametrize("order", ["C", "F"])
def test_healthy_deviations_are_integrated_out(rank: int, order: str) -> None:
    """Whatever the rank of the covariance, and however the arrays lie in memory, as those of chosen coefficients do."""
    found = Evidence.of(white(1), np.arange(3.0))
    given = Evidence(np.array(found.matrix, order=order), np.array(found.vector, order=order), *list(vars(found).values())[2:])
    mean, covariance = np.array([0.1, 0.0, -0.2, 0.0, 0.3]), covariance_of_rank(rank)
    told, wanted = given.given(mean, covariance), integrated_out(found, mean, covariance)
    assert told.matrix == pytest.approx(wanted.matrix, rel=1e-8, abs=1e-8 * float(np.abs(wanted.matrix).max()))
    assert told.vector == pytest.approx(wanted.vector, rel=1e-8, abs=1e-8 * float(np.abs(wanted.vector).max()))
    assert told.log == pytest.approx(wanted.log, rel=1e-9) and told.squares == pytest.approx(wanted.squares, rel=1e-9)
    assert np.array_equal(told.matrix, told.matrix.mT)


def test_coefficients_that_are_chosen_are_integrated_out_likewise() -> None:
    """As `HypothesisTest.change` chooses them: these arrays lie in memory in another order."""
    found, kept = Evidence.of(white(2), np.zeros(LEVELS)), [0, 1, 2, 3, 4, 7]
    chosen = found.about(np.zeros(COUNT), kept)
    mean, covariance = np.full(HEALTHY, 0.1), covariance_of_rank(3)
    told, wanted = chosen.given(mean, covariance), found.given(mean, covariance)
    assert told.matrix == pytest.approx(wanted.matrix[:, kept][:, :, kept], rel=1e-9, abs=1e-6)
    assert told.vector == pytest.approx(wanted.vector[:, kept], rel=1e-9, abs=1e-9)


def test_blocks_are_added_as_one_after_the_other() -> None:
    first, second, log = white(3, 6), white(4, 4), np.array([1.0, 2.0, 3.0])
    told = Evidence.of(first, log).with_rows(second, log, 0.3)
    wanted = Evidence.of(first, log) + Evidence.of(second, log).weighted(0.3)
    for name in ("matrix", "vector", "squares", "log"):
        assert getattr(told, name) == pytest.approx(getattr(wanted, name), rel=1e-12)
    assert told.rows == pytest.approx(6 + 0.3 * 4)
