"""The bank of hypotheses against dense Gaussian model comparison."""

from __future__ import annotations

import numpy as np
import pytest
from health.gaussian import covariance_of, log_density
from scipy.integrate import quad

from boom_twin.health.inference.fault_catalogue import Form, Parameter
from boom_twin.health.inference.hypotheses import UNKNOWN, UNKNOWN_PRIOR, Evidence, HypothesisTest
from boom_twin.health.residual_monitor import drifts_from

KNOWN = (
    Parameter("cylinder_1.k", "softer", Form.SCENE, 0, "", 0.02, 0.5, one_sided=True),
    Parameter("joint_1.sensor", "bias", Form.ANGLE, 0, "rad", 0.1, 2.0),
    Parameter("joint_1.sensor", "drift", Form.DRIFT, 0, "rad/s", 0.0, 1.0, prior=0.3),
    Parameter("joint_2.sensor", "bias", Form.ANGLE, 1, "rad", 0.1, 3.0),
    Parameter("section_1.mass", "changed", Form.SCENE, 0, "", 0.2, 0.0),
)
BANK, SIZE = HypothesisTest(KNOWN), len(KNOWN)


class Problem:
    """White rows y = S theta + e with everything that is known of theta."""

    def __init__(self, seed: int, fault: dict[int, float] | None = None, rows: int = 20) -> None:
        rng = np.random.default_rng(seed)
        self.mean, self.covariance = 0.1 * rng.normal(size=SIZE), covariance_of(rng, SIZE, 0.1)
        self.signature = rng.normal(size=(rows, SIZE))
        theta = rng.multivariate_normal(self.mean, self.covariance)
        for place, value in (fault or {}).items():
            theta[place] += value
        self.values = self.signature @ theta + rng.normal(size=rows)
        self.spread = np.eye(rows) + self.signature @ self.covariance @ self.signature.T

    def evidence(self, wide: float = 30.0) -> Evidence:
        """In three parts; of an unknown fault, that of noise `wide` times as large."""
        found = Evidence.none(SIZE)
        for rows in np.array_split(np.arange(len(self.values)), 3):
            y = self.values[rows]
            unknown = log_density(y, np.zeros(len(y)), wide**2 * np.eye(len(y)))
            found += Evidence.of(np.column_stack([y, self.signature[rows]]), float(-0.5 * y @ y), unknown)
        return found

    def log(self, place: int | None = None, more: float = 0.0, value: float = 0.0) -> float:
        """Of the values, with one parameter of `more` variance, and of `value` beyond what is healthy."""
        column = np.zeros(len(self.values)) if place is None else self.signature[:, place]
        at = self.signature @ self.mean + value * column
        return log_density(self.values, at, self.spread + more * np.outer(column, column))

    def verdict(self):
        return BANK.explain(self.evidence(), self.mean, self.covariance, 60.0)


def explained(verdict):
    return {part.place: part for cause in verdict.causes for part in cause.parts}


@pytest.mark.parametrize("seed", range(5))
def test_healthy_deviations_are_integrated_out(seed):
    problem = Problem(seed)
    healthy = problem.evidence().given(problem.mean, problem.covariance)
    assert healthy.log == pytest.approx(problem.log(), abs=1e-9)
    left = problem.values - problem.signature @ problem.mean
    solved = np.linalg.solve(problem.spread, np.column_stack([problem.signature, left]))
    assert healthy.matrix == pytest.approx(problem.signature.T @ solved[:, :-1], abs=1e-9)
    assert healthy.vector == pytest.approx(problem.signature.T @ solved[:, -1], abs=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_every_fault_is_as_probable_as_densely(seed):
    problem = Problem(seed, {1: 1.5})
    found = explained(problem.verdict())
    assert set(found) == {0, 1, 2, 3, None}, "what has no faulty deviation is no fault"
    for place in (1, 2, 3):
        dense = problem.log(place, KNOWN[place].faulty ** 2) - problem.log()
        assert found[place].log_factor == pytest.approx(dense, abs=1e-8)
    column = problem.signature[:, 1]
    gain = np.linalg.solve(problem.spread, column)
    information = column @ gain + 1.0 / KNOWN[1].faulty ** 2
    assert found[1].sigma == pytest.approx(information**-0.5)
    assert found[1].value == pytest.approx(gain @ (problem.values - problem.signature @ problem.mean) / information)


@pytest.mark.parametrize("value", [0.8, 0.0, -0.8])
def test_a_one_sided_fault(value):
    """Its prior is the half of the normal one, and twice as dense: by quadrature."""
    problem = Problem(3, {0: value})
    found = explained(problem.verdict())[0]
    sigma, none = KNOWN[0].faulty, problem.log()

    def density(at: float) -> float:
        prior = 2.0 * np.exp(-0.5 * (at / sigma) ** 2) / (np.sqrt(2.0 * np.pi) * sigma)
        return float(prior * np.exp(problem.log(0, 0.0, at) - none))

    whole, _ = quad(density, 0.0, 8.0 * sigma, points=[max(found.value, 0.0)], epsabs=0.0, epsrel=1e-10, limit=200)
    assert found.log_factor == pytest.approx(np.log(whole), abs=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_probabilities(seed):
    """They are Bayes' of all faults, each with its prior; what has one cause counts together."""
    verdict = Problem(seed, {3: 2.0}).verdict()
    assert sum(cause.probability for cause in verdict.causes) == pytest.approx(1.0)
    assert [cause.probability for cause in verdict.causes] == sorted((c.probability for c in verdict.causes), reverse=True)
    priors = {None: UNKNOWN_PRIOR} | {i: each.prior for i, each in enumerate(KNOWN)}
    weights = {p: np.exp(e.log_factor / verdict.excess) * priors[p] for p, e in explained(verdict).items()}
    sensor = next(cause for cause in verdict.causes if cause.name == "joint_1.sensor")
    assert {part.place for part in sensor.parts} == {1, 2}
    assert sensor.probability == pytest.approx((weights[1] + weights[2]) / sum(weights.values()))
    assert verdict.causes[0].name == "joint_2.sensor" and verdict.best.place == 3


def test_right_fault_wins_as_often_as_it_says():
    """Faults drawn from their own priors: the cause named first is the right one as often as its probability claims."""
    rng, claimed, right = np.random.default_rng(2), [], []
    for seed in range(300):
        place = int(rng.choice([1, 3]))
        best = Problem(seed, {place: rng.normal(0.0, KNOWN[place].faulty)}, 8).verdict().causes[0]
        claimed.append(best.probability)
        right.append(best.name == KNOWN[place].cause)
    sure = np.array(claimed) > 0.95
    assert sure.sum() > 50
    assert np.mean(np.array(right)[sure]) > 0.93


def test_two_faults_at_once_are_unknown():
    problem = Problem(4, {1: 6.0, 3: -8.0}, 40)
    verdict = problem.verdict()
    assert verdict.causes[0].name == UNKNOWN and verdict.best.place is None
    assert verdict.excess > 10.0
    alone = Problem(4, {1: 5.0}, 40).verdict()
    assert alone.causes[0].name == "joint_1.sensor" and alone.excess < 2.0


def test_excess_makes_unsure():
    """Squares that are left over those of noise divide all logarithms; in white ones there are none."""
    problem = Problem(5, {3: 3.0}, 200)
    clean = problem.verdict()
    assert 1.0 <= clean.excess < 1.0 + 5.0 * np.sqrt(2.0 / 200)
    problem.values += 3.0 * np.random.default_rng(1).normal(size=200)
    rough = problem.verdict()
    healthy = problem.evidence().given(problem.mean, problem.covariance)
    fitted = max(2.0 * (problem.log(i, 0.0, found.value) - problem.log()) + found.value**2 / KNOWN[i].faulty ** 2
                 for i, found in explained(rough).items() if i is not None)  # fmt: skip
    assert rough.excess == pytest.approx((healthy.squares - fitted) / 200, rel=0.05) and rough.excess > 5.0
    assert rough.strength == pytest.approx(rough.best.log_factor / rough.excess)


def test_support():
    problem = Problem(6, {3: 2.0})
    best = explained(problem.verdict())[3]
    found = BANK.support(problem.evidence(), best, problem.mean, problem.covariance)
    assert found == pytest.approx(problem.log(3, 0.0, best.value) - problem.log(), abs=1e-8) and found > 0.0
    later = Problem(7, {})
    assert BANK.support(later.evidence(), best, later.mean, later.covariance) < 0.0, "the fault has gone"


def test_drifts_begin_with_the_case():
    """The drift's column, in proportion to time since the clock began, becomes one in proportion to time since the case did."""
    rng, start = np.random.default_rng(8), 40.0
    times = start + np.arange(10.0)
    signature = rng.normal(size=(10, SIZE))
    signature[:, 1], signature[:, 2] = 1.0, times
    values = 0.5 * (times - start) + rng.normal(size=10)
    turn = drifts_from(KNOWN, start)
    turned = Evidence.of(np.column_stack([values, signature]), 0.0, 0.0).turned(turn)
    signature[:, 2] = times - start
    wanted = Evidence.of(np.column_stack([values, signature]), 0.0, 0.0)
    assert turned.matrix == pytest.approx(wanted.matrix, abs=1e-8) and turned.vector == pytest.approx(wanted.vector, abs=1e-8)
    assert drifts_from(KNOWN, 0.0) == pytest.approx(np.eye(SIZE))
