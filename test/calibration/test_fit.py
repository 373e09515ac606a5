"""A fit: unknowns that are left out, bounds, and the covariance of what may be wrong with the model."""

from __future__ import annotations

import numpy as np
import pytest

from boom_twin.calibration import fit
from boom_twin.calibration.fit import CalibrationProblem, Fit, Noise, bounded_minimum, fitted


def fit_of(slopes: np.ndarray, measured: np.ndarray, by_model: np.ndarray | None = None) -> Fit:
    """Of white residuals `measured` that deviations change by `slopes`, with the priors."""
    information, unknowns = slopes.T @ slopes, slopes.shape[1]
    best = np.linalg.solve(information + np.eye(unknowns), slopes.T @ measured)
    none = np.zeros((unknowns, 0)) if by_model is None else by_model
    return Fit(best, information, information, np.zeros(unknowns), none, np.ones(0), 1)


@pytest.mark.parametrize("left_out", [[1], [0, 3], []])
def test_what_is_left_out_is_made_up_for_by_the_others(left_out: list[int]) -> None:
    """As if these had never been unknown: the minimum of the same squares where they stay 0."""
    random = np.random.default_rng(len(left_out))
    slopes, measured = 30.0 * random.normal(size=(50, 4)), 30.0 * random.normal(size=50)
    slopes[:, 1] = 0.98 * slopes[:, 2] + 0.2 * slopes[:, 1]  # two that look nearly alike
    kept = [i for i in range(4) if i not in left_out]
    alone = fit_of(slopes[:, kept], measured)
    found = fit_of(slopes, measured).without(left_out, np.full(4, -np.inf))
    assert found[kept] == pytest.approx(alone.deviations, rel=1e-9) and not found[left_out].any()


def test_a_payload_is_not_taken_over_below_its_bound() -> None:
    """The others make up for what is left out, and not by a negative mass; on a bound they are what fits best there."""
    random = np.random.default_rng(5)
    slopes = 30.0 * random.normal(size=(50, 3))
    slopes[:, 1] = 0.98 * slopes[:, 0] + 0.2 * slopes[:, 1]
    fit, least = fit_of(slopes, slopes @ [0.5, -0.6, 1.0]), np.array([-np.inf, -0.1, -np.inf])
    assert fit.without([0], np.full(3, -np.inf))[1] < -0.1
    assert fit.without([0], least)[1] == pytest.approx(-0.1)

    precision, pull = slopes.T @ slopes + np.eye(3), slopes.T @ (slopes @ [0.5, -0.6, 1.0])
    found = bounded_minimum(precision, pull, least)
    slope = precision @ found - pull
    assert found[1] == pytest.approx(-0.1) and slope[1] > 0.0 and slope[[0, 2]] == pytest.approx(0.0, abs=1e-6)


def test_the_covariance_allows_for_what_may_be_wrong_with_the_model() -> None:
    """Monte Carlo: readings with noise, and with a parameter that the fit does not know, of deviation 1."""
    random = np.random.default_rng(6)
    slopes, other = 5.0 * random.normal(size=(80, 2)), 3.0 * random.normal(size=80) + 2.0
    fit = fit_of(slopes, np.zeros(80), slopes.T @ other[:, None])
    readings = random.normal(size=(20000, 80)) + random.normal(size=(20000, 1)) * other
    errors = np.linalg.solve(fit.precision, slopes.T @ readings.T)
    np.testing.assert_allclose(fit.covariance(), np.cov(errors) + np.linalg.inv(fit.precision) @ np.linalg.inv(fit.precision),
                               rtol=0.06, atol=2e-5)  # fmt: skip


class Bent(CalibrationProblem):
    """Two unknowns, the first of which has a lower bound, that change the readings by a square, too."""

    names, channels, blocks, least = ("joint_2",), np.zeros(40, int), np.arange(40) // 4, np.array([-0.5, -np.inf])

    def __init__(self) -> None:
        self.readings = np.random.default_rng(7).normal(size=40)

    def start(self):
        return np.zeros(2)

    def sensor_noise(self):
        return np.ones(1)

    def noise(self, deviations, sensors):
        return Noise(np.ones((1, 2)), sensors)

    def values(self, deviations):
        assert deviations[0] >= self.least[0]
        return dict(zip("ab", deviations.tolist(), strict=True))

    bend = 100.0

    def innovations(self, trials, noise):
        bent = [trial["a"] + trial["b"] + self.bend * trial["a"] ** 2 for trial in trials]
        return [np.column_stack([self.readings - each, np.ones(40)]) for each in bent]

    def slopes_by_model(self, *_):
        return np.zeros((0, 40, 2))


def test_derivatives_are_right_where_readings_bend_and_do_not_leave_the_bounds() -> None:
    found = Bent().slopes(np.array([0.3, 0.2]), Noise(np.ones((1, 2)), np.ones(1)))
    assert found[:, 0, 0] == pytest.approx([-61.0, -1.0], rel=1e-9) and not found[:, :, 1].any()
    Bent().slopes(np.array([-0.5, 0.0]), Noise(np.ones((1, 2)), np.ones(1)))


def test_a_fit_that_still_moves_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fit, "MOST", 1)
    assert not fitted(Bent(), (), lambda passes: None).is_settled


def test_a_step_that_had_to_be_shortened_is_no_end() -> None:
    """Readings of 10 bend so fast that the first step ends at 1/32 of its length, with residuals of 1000."""
    problem = Bent()
    problem.bend, problem.readings = 1e6, np.full(40, 10.0)
    found = fitted(problem, (), lambda passes: None)
    (left,) = problem.innovations([problem.values(found.deviations)], None)
    assert found.is_settled == (abs(left[:, 0]).max() < 3.0), (found, left[0])


def test_a_fit_is_settled_where_a_whole_step_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Derivatives are off by so much that every step is a quarter of a deviation, which changes the log likelihood by 0.03."""
    problem, slopes = Bent(), Bent.slopes
    problem.bend = 0.0
    best = fitted(problem, (), lambda passes: None).deviations

    def biased(self, deviations, noise):
        (base,) = self.innovations([self.values(deviations)], noise)
        return slopes(self, deviations, noise) + np.array([0.0, 0.5])[:, None, None] * base[:, :1] / 40.0 * [1.0, 0.0]

    monkeypatch.setattr(Bent, "slopes", biased)
    monkeypatch.setattr(Bent, "start", lambda self: best)
    found = fitted(problem, (), lambda passes: None)
    assert found.is_settled and found.passes == 2 and found.deviations == pytest.approx(best, abs=0.05)
