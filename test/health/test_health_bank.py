"""The bank of hypotheses against dense Gaussian model comparison."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from health.gaussian import covariance_of, log_density
from scipy.integrate import quad

from boom_twin.health.inference.evidence_kernels import GROWING_PRIOR, GROWN
from boom_twin.health.inference.fault_catalogue import Form, Parameter
from boom_twin.health.inference.hypotheses import CRUDE, Evidence, Explanation, HypothesisTest

KNOWN = (
    Parameter("cylinder_1.k", "softer", Form.SCENE, 0, "", 0.02, 0.5, least=0.0),
    Parameter("joint_1.sensor", "bias", Form.ANGLE, 0, "rad", 0.1, 2.0),
    Parameter("joint_1.sensor", "scale", Form.ANGLE, 0, "", 0.0, 1.0, prior=0.3),
    Parameter("joint_2.sensor", "bias", Form.ANGLE, 1, "rad", 0.1, 3.0),
    Parameter("section_1.mass", "changed", Form.SCENE, 0, "", 0.2, 0.0),
)
BANK, SIZE = HypothesisTest(KNOWN), len(KNOWN)


SPAN = 60.0  # s


class Problem:
    """White rows y = S theta + e, at equal steps of `SPAN`, with everything that is known of theta; a fault may grow."""

    def __init__(self, seed: int, fault: dict[int, float] | None = None, rows: int = 20, rate: float = 0.0) -> None:
        rng = np.random.default_rng(seed)
        self.mean, self.covariance = 0.1 * rng.normal(size=SIZE), covariance_of(rng, SIZE, 0.1)
        self.signature = rng.normal(size=(rows, SIZE))
        self.times = np.linspace(0.0, SPAN, rows)
        theta = rng.multivariate_normal(self.mean, self.covariance)
        for place, value in (fault or {}).items():
            theta[place] += value
        self.values = self.signature @ theta + rng.normal(size=rows)
        for place in fault or {}:
            self.values += rate * self.times * self.signature[:, place]
        self.spread = np.eye(rows) + self.signature @ self.covariance @ self.signature.T

    def evidence(self) -> Evidence:
        """In three parts; of one level of the load."""
        found = Evidence.none(BANK.coefficient_count, (1,))
        table = np.hstack([self.signature, self.times[:, None] * self.signature[:, BANK.growing]])
        for rows in np.array_split(np.arange(len(self.values)), 3):
            y = self.values[rows]
            log = log_density(y, np.zeros(len(y)), np.eye(len(y)))
            found += Evidence.of(np.column_stack([y, table[rows]])[None], np.array([log]))
        return found

    def log(self, place: int | None = None, more: float = 0.0, value: float = 0.0) -> float:
        """Of the values, with one parameter of `more` variance, and of `value` beyond what is healthy."""
        column = np.zeros(len(self.values)) if place is None else self.signature[:, place]
        at = self.signature @ self.mean + value * column
        return log_density(self.values, at, self.spread + more * np.outer(column, column))

    def verdict(self):
        return BANK.explain(self.evidence(), self.mean, self.covariance, SPAN, {})


def explained(verdict, growing: bool = False):
    return {part.place: part for cause in verdict.causes for part in cause.parts if (part.rate != 0.0) == growing}


def probability(verdict, name: str) -> float:
    return next(cause.probability for cause in verdict.causes if cause.name == name)


@pytest.mark.parametrize("seed", range(5))
def test_healthy_deviations_are_integrated_out(seed):
    problem = Problem(seed)
    healthy = problem.evidence().given(problem.mean, problem.covariance)
    assert healthy.log[0] == pytest.approx(problem.log(), abs=1e-9)
    left = problem.values - problem.signature @ problem.mean
    solved = np.linalg.solve(problem.spread, np.column_stack([problem.signature, left]))
    assert healthy.matrix[0, :SIZE, :SIZE] == pytest.approx(problem.signature.T @ solved[:, :-1], abs=1e-9)
    assert healthy.vector[0, :SIZE] == pytest.approx(problem.signature.T @ solved[:, -1], abs=1e-9)
    growing = problem.times[:, None] * problem.signature[:, BANK.growing]
    assert healthy.vector[0, SIZE:] == pytest.approx(growing.T @ solved[:, -1], abs=1e-7)


@pytest.mark.parametrize("seed", range(5))
def test_every_fault_is_as_probable_as_densely(seed):
    problem = Problem(seed, {1: 1.5})
    found = explained(problem.verdict())
    assert set(found) == {0, 1, 2, 3}, "what has no faulty deviation is no fault"
    for place in (1, 2, 3):
        dense = problem.log(place, KNOWN[place].faulty ** 2) - problem.log()
        assert found[place].log_factor == pytest.approx(dense, abs=1e-8)
    column = problem.signature[:, 1]
    gain = np.linalg.solve(problem.spread, column)
    information = column @ gain + 1.0 / KNOWN[1].faulty ** 2
    assert found[1].sigma == pytest.approx(information**-0.5)
    assert found[1].value == pytest.approx(gain @ (problem.values - problem.signature @ problem.mean) / information)


def test_the_usual_size_of_an_offset_is_no_bound():
    """A sensor may be off by any amount: the width of the prior is that which makes the measurements most probable."""
    problem = Problem(2, {1: 40.0})
    found = explained(problem.verdict())[1]
    dense = [problem.log(1, width**2) - problem.log() for width in np.geomspace(2.0, 400.0, 400)]
    assert found.log_factor == pytest.approx(max(dense), abs=1e-3) and max(dense) > dense[0] + 100.0
    assert found.value == pytest.approx(40.0, abs=4.0 * found.sigma)


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


def test_no_sensor_drifts_through_zero():
    """As little as a spring: a line that has another sign early on is no growing fault."""
    away, through = (explained(Problem(1, {3: at}, rate=0.2).verdict(), growing=True)[3] for at in (1.0, -8.0))
    assert away.log_factor > through.log_factor + 20.0


@pytest.mark.parametrize("seed", range(5))
def test_a_growing_fault_is_as_probable_as_densely(seed):
    """Its size at the beginning and its rate, both unknown; the estimate is that at the end."""
    problem = Problem(seed, {3: 0.5}, rate=0.2)
    found = explained(problem.verdict(), growing=True)[3]
    columns = np.stack([np.ones(20), problem.times], axis=1) * problem.signature[:, [3]]
    prior = KNOWN[3].faulty ** 2 * np.diag([1.0, 1.0 / GROWN**2])
    spread = problem.spread + columns @ prior @ columns.T
    left = problem.signature @ problem.mean
    wanted = log_density(problem.values, left, spread) - problem.log() + np.log(GROWING_PRIOR)
    assert found.log_factor == pytest.approx(wanted + np.log(2.0), abs=1e-7), "and of one sign all the time"
    assert found.rate == pytest.approx(0.2, abs=5.0 * found.rate_sigma) and found.is_growing
    assert found.value == pytest.approx(0.5 + 0.2 * SPAN, abs=5.0 * found.sigma)


@pytest.mark.parametrize("seed", range(5))
def test_probabilities(seed):
    """They are Bayes' of all faults, each with its prior; what has one cause counts together, whatever its shape."""
    verdict = Problem(seed, {3: 2.0}).verdict()
    assert sum(cause.probability for cause in verdict.causes) == pytest.approx(1.0)
    assert [cause.probability for cause in verdict.causes] == sorted((c.probability for c in verdict.causes), reverse=True)
    scale = verdict.excess * (1.0 + CRUDE * verdict.strength * verdict.excess)
    weights, steady = (dict.fromkeys(range(4), 0.0) for _ in range(2))
    for growing in (False, True):
        for place, each in explained(verdict, growing).items():
            weights[place] += np.exp(each.log_factor / scale) * KNOWN[place].prior
            steady[place] += 0.0 if growing else np.exp(each.log_factor / scale) * KNOWN[place].prior
    sensor = next(cause for cause in verdict.causes if cause.name == "joint_1.sensor")
    assert {part.place for part in sensor.parts} == {1, 2}
    assert sensor.probability == pytest.approx((weights[1] + weights[2]) / sum(weights.values()))
    assert sensor.steady == pytest.approx((steady[1] + steady[2]) / sum(steady.values())), "of faults that do not grow"
    assert verdict.causes[0].name == "joint_2.sensor" and verdict.best.place == 3


def test_a_fault_is_as_strong_as_it_is_by_both_filters():
    """Of a filter that makes all that was measured much more probable; two that tell of two faults tell of none."""
    one, other, both, none = (Problem(5, each) for each in ({1: 3.0}, {3: 4.0}, {1: 3.0, 3: 4.0}, {}))

    def strength(second: Problem, more: float) -> float:
        also = second.evidence()
        better = replace(also, log=one.evidence().log + more)
        return BANK.explain(one.evidence(), one.mean, one.covariance, SPAN, {}, 1.0, better).strength

    alone = one.verdict().strength
    assert alone > 20.0 and other.verdict().strength > 20.0
    assert strength(none, -200.0) == pytest.approx(alone), "one that hardly explains what was measured says nothing"
    assert strength(one, 200.0) == pytest.approx(alone)
    assert strength(both, 200.0) > 10.0, "what both tell is left"
    assert max(strength(none, 200.0), strength(other, 200.0)) < 5.0


def test_odds_that_many_postures_bear_out_count_for_more():
    """What signatures are wrong by makes large odds less sure: by half as much where it is another error all the time."""
    problem = Problem(5, {3: 3.0}, 40)
    one, many = (
        BANK.explain(problem.evidence(), problem.mean, problem.covariance, SPAN, {}, postures) for postures in (1.0, 1e6)
    )
    names = "joint_2.sensor", "joint_1.sensor"
    for verdict, crude in ((one, CRUDE), (many, 0.5 * CRUDE)):
        found = explained(verdict)
        scale = verdict.excess * (1.0 + crude * verdict.strength * verdict.excess)
        both = sum(np.exp(found[place].log_factor / scale) * KNOWN[place].prior for place in (1, 2))
        assert found[3].log_factor / scale - np.log(both) == pytest.approx(
            np.log([each.steady for name in names for each in verdict.causes if each.name == name]) @ [1.0, -1.0]
        )
    assert one.strength == many.strength > 100.0


def test_what_was_known_before_counts():
    problem = Problem(1, {3: 2.0})
    carried = {"joint_2.sensor": -3.0}
    first, later = problem.verdict(), BANK.explain(problem.evidence(), problem.mean, problem.covariance, SPAN, carried)
    odds = [share / (1.0 - share) for share in (probability(first, "joint_2.sensor"), probability(later, "joint_2.sensor"))]
    assert odds[1] / odds[0] == pytest.approx(np.exp(-3.0), rel=1e-6)
    alone = {cause.name: cause.alone for cause in later.causes}
    assert alone == pytest.approx({cause.name: cause.probability for cause in first.causes}), "but not for this evidence alone"


def test_the_load_is_part_of_every_hypothesis():
    """Under a load that explains everything no fault is more probable than none; without it one is."""
    problem = Problem(2, {3: 4.0})
    own = problem.evidence()
    under = np.array([1.0, 0.0])
    matrix, vector = under[:, None, None] * own.matrix, under[:, None] * own.vector
    both = Evidence(matrix, vector, under * own.squares, own.rows, own.log + np.array([0.0, 500.0]))
    args = problem.mean, problem.covariance, SPAN, {}
    alone, both = BANK.explain(own, *args), BANK.explain(both, *args)
    assert alone.strength > 20.0 and alone.level == 0
    assert both.strength < 1.0 and both.level == 1


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


def test_two_faults_at_once_do_not_fit():
    assert Problem(4, {1: 6.0, 3: -8.0}, 40).verdict().excess > 10.0
    alone = Problem(4, {1: 5.0}, 40).verdict()
    assert alone.causes[0].name == "joint_1.sensor" and alone.excess < 2.0


def test_excess_makes_unsure():
    """Squares that are left over those of noise divide all logarithms; in white ones there are none."""
    problem = Problem(5, {3: 3.0}, 200)
    clean = problem.verdict()
    assert 1.0 <= clean.excess < 1.0 + 5.0 * np.sqrt(2.0 / 200)
    problem.values += 3.0 * np.random.default_rng(1).normal(size=200)
    rough = problem.verdict()
    assert rough.excess > 5.0
    assert rough.strength == pytest.approx(rough.best.log_factor / rough.excess)


def test_fit_of_a_known_fault():
    problem = Problem(6, {3: 2.0})
    best = explained(problem.verdict())[3]
    args = problem.mean, problem.covariance
    logs, squares = BANK.fit(problem.evidence(), BANK.coefficients(best, SPAN), *args)
    assert logs[0] == pytest.approx(problem.log(3, 0.0, best.value), abs=1e-8) and squares[0] < 2.0
    later = Problem(7, {})
    logs, squares = BANK.fit(later.evidence(), BANK.coefficients(best, SPAN), later.mean, later.covariance)
    assert logs[0] < later.log() and squares[0] > 2.0, "the fault has gone"


@pytest.mark.parametrize("rate, bound", [(0.0, 0.0), (0.3, 12.0)])
def test_another_size_of_a_known_fault_is_as_probable_as_densely(rate, bound):
    """Of a size and a rate that differ from those of the explanation, each normal; only what grows on has changed."""
    problem, each = Problem(6, {3: 2.0}, 40, rate), Explanation(3, 0, 0.0, 2.0, 0.1)
    logs, squares, changed, _ = BANK.change(problem.evidence(), each, SPAN, SPAN, problem.mean, problem.covariance)
    same, left = BANK.fit(problem.evidence(), BANK.coefficients(each, SPAN), problem.mean, problem.covariance)
    assert logs == pytest.approx(same) and squares == pytest.approx(left)
    columns = np.stack([np.ones(40), problem.times], axis=1) * problem.signature[:, [3]]
    prior = KNOWN[3].faulty ** 2 * np.diag([1.0, 1.0 / GROWN**2])
    at = problem.signature @ problem.mean + 2.0 * columns[:, 0]
    other = log_density(problem.values, at, problem.spread + columns @ prior @ columns.T)
    assert changed == pytest.approx(other - problem.log(3, 0.0, 2.0), abs=1e-7)
    assert changed > bound if rate else changed < bound


def test_what_another_load_explains_is_no_other_size():
    """The change is weighed with the load that suits it beside none with the load that suits that."""
    each, rises, stays = Explanation(3, 0, 0.0, 2.0, 0.1), Problem(6, {3: 2.0}, 40, 0.3), Problem(7, {3: 2.0}, 40)
    mean, covariance = rises.mean, rises.covariance
    own, other = rises.evidence(), stays.evidence()
    alone = BANK.change(own, each, SPAN, SPAN, mean, covariance)[2]
    assert alone > 12.0
    for ahead, least, most in ((-1e4, alone, alone), (1e4, -10.0, 2.0)):  # of the load under which nothing has changed
        pairs = [(getattr(own, name), getattr(other, name)) for name in ("matrix", "vector", "squares")]
        both = Evidence(*(np.concatenate(pair) for pair in pairs), own.rows, np.concatenate([own.log, own.log + ahead]))
        assert least - 1e-6 <= BANK.change(both, each, SPAN, SPAN, mean, covariance)[2] <= most + 1e-6


def test_levels_together_are_those_of_each_alone():
    """The evidence of several levels of the load is weighed at once; each is as if it were alone."""
    problems = Problem(8, {3: 1.0}), Problem(9, {0: 0.5})
    each = [problem.evidence() for problem in problems]
    both = Evidence(*(np.concatenate([getattr(one, name) for one in each]) for name in ("matrix", "vector", "squares")),
                    each[0].rows, np.concatenate([one.log for one in each]))  # fmt: skip
    mean, covariance = problems[0].mean, problems[0].covariance
    coefficients = np.random.default_rng(3).normal(size=BANK.coefficient_count)
    logs, squares = BANK.fit(both, coefficients, mean, covariance)
    alone = [BANK.fit(one, coefficients, mean, covariance) for one in each]
    assert logs == pytest.approx(np.concatenate([log for log, _ in alone]), rel=1e-12)
    assert squares == pytest.approx(np.concatenate([left for _, left in alone]), rel=1e-12)
    assert both.given(mean, covariance).matrix == pytest.approx(
        np.concatenate([one.given(mean, covariance).matrix for one in each]), rel=1e-12, abs=1e-12
    )


def test_coefficients_are_those_of_the_beginning():
    growing = Explanation(3, 0, 1.0, 5.0, 0.1, 0.2, 0.01)
    found = BANK.coefficients(growing, 10.0)
    assert found[3] == pytest.approx(3.0) and found[3 + SIZE] == 0.2 and np.count_nonzero(found) == 2


def test_a_fault_below_its_least_value_explains_nothing():
    """Less concrete than an empty line holds is no cause, however well it would fit."""
    known = (
        Parameter("line_fill", "changed", Form.SCENE, 0, "kg/m", 0.1, 5.0, least=0.0),
        Parameter("tip_imu.sensor", "bias x", Form.IMU, 0, "m/s^2", 0.01, 0.5),
    )
    white = np.array([[-10.0, 1.0, 0.0, 0.0, 0.0], [-9.0, 0.0, 20.0, 0.0, 0.0]])
    verdict = HypothesisTest(known).explain(Evidence.of(white[None], np.zeros(1)), np.zeros(2), np.zeros((2, 2)), 1.0, {})
    assert verdict.causes[0].name == "tip_imu.sensor"
    assert max(part.log_factor for cause in verdict.causes if cause.name == "line_fill" for part in cause.parts) < 1.0


def test_a_growing_fault_below_its_least_value_early_on_explains_nothing():
    """A section twice as stiff that grows as soft as the scene has it is none, though its size at the end may be."""
    rows, times = 30, np.linspace(0.0, 10.0, 30)
    white = np.zeros((rows, 1 + BANK.coefficient_count))
    white[:, 0] = 3.0 * (times / 10.0 - 1.0)
    white[:, 1], white[:, 1 + SIZE] = 3.0, 3.0 * times
    verdict = BANK.explain(Evidence.of(white[None], np.zeros(1)), np.zeros(SIZE), np.zeros((SIZE, SIZE)), 10.0, {})
    assert explained(verdict, growing=True)[0].log_factor < 0.0
    white[:, 0] = 3.0 * times / 10.0
    verdict = BANK.explain(Evidence.of(white[None], np.zeros(1)), np.zeros(SIZE), np.zeros((SIZE, SIZE)), 10.0, {})
    assert explained(verdict, growing=True)[0].log_factor > 10.0


def test_what_shows_in_no_reading_is_no_cause():
    """An IMU that is not there, say; it explains nothing, and so nothing worse than healthy deviations do."""
    problem = Problem(2, {1: 0.3})
    with_it = probability(problem.verdict(), "joint_2.sensor")
    problem.signature[:, 3] = 0.0
    verdict = problem.verdict()
    assert with_it > 0.01 and probability(verdict, "joint_2.sensor") == 0.0
    assert sum(cause.probability for cause in verdict.causes) == pytest.approx(1.0)
