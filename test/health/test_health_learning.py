"""Learning on problems whose parameters and errors are known, because they were drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boom_twin.errors import UsageError
from boom_twin.health.baseline import Baseline
from boom_twin.health.inference.block_problem import BlockProblem
from boom_twin.health.inference.fault_catalogue import Form, Parameter
from boom_twin.health.inference.holds import HoldProblem
from boom_twin.health.inference.hypotheses import Regression
from boom_twin.health.inference.innovation_filter import REACH, REST, ModalStates
from boom_twin.health.learning import LEAST, _learn_frequencies, learn

BLOCK, JOINTS, TRAVEL = 0.1, 2, 0.01
KNOWN = (
    Parameter("cylinder_1.k", "softer", Form.SCENE, 0, "", 0.02, 0.5, least=0.0),
    Parameter("tip.payload", "changed", Form.SCENE, 0, "kg", 1.0, 30.0),
    Parameter("joint_1.sensor", "bias", Form.ANGLE, 0, "rad", 1e-4, 5e-3),
    Parameter("cylinder_1.rod.clearance", "grown", Form.PLAY, 0, "m", 0.0, 4e-4),
)
THETA = np.array([0.03, -1.2, 1.5e-4, 0.0])
CHANNELS = JOINTS + 2
STILL = ModalStates(
    np.zeros(0), *(np.zeros((0, 0)) for _ in range(4)), np.zeros((CHANNELS, 0)), np.zeros(CHANNELS), np.zeros((0, 2)),
    np.zeros((CHANNELS, 2)),
)  # fmt: skip


def session(seed: int, blocks: int, angle_error: float = 2e-4, angle_noise: float = 1.0) -> list[BlockProblem]:
    """A boom that moves slowly: signatures turn, model errors are forgotten on the way."""
    rng, found = np.random.default_rng(seed), []
    errors, own = np.array([angle_error] * 2 + [0.02] * 2), np.array([4e-5] * 2 + [0.011] * 2)
    kept = math.exp(-(TRAVEL + REST * BLOCK) / REACH)
    error = errors * rng.normal(size=4)
    for k in range(blocks):
        error = kept * error + math.sqrt(1.0 - kept**2) * errors * rng.normal(size=4)
        turn = 0.02 * k + seed
        columns = np.zeros((4, len(KNOWN)))
        columns[:, 0] = [0.01 * math.cos(turn), 0.004 * math.sin(turn), 0.1 * math.sin(2 * turn), 0.05]
        columns[:, 1] = [1e-4 * math.sin(turn), 1e-4, 0.01 * math.cos(turn), 0.01 * math.sin(turn)]
        columns[0, 2], columns[0, 3] = 1.0, k * BLOCK
        noise = own * np.array([angle_noise] * 2 + [1.9] * 2) * rng.normal(size=4)
        table = np.column_stack([columns @ THETA + error + noise, columns])
        found.append(BlockProblem(k, table, own**2, np.zeros((4, 4)), 0.0, TRAVEL, STILL))
    return found


@pytest.mark.slow
def test_parameters_and_errors_are_found():
    """What was drawn is recovered: parameters within what is claimed, their errors and the noise near the grid's ratio."""
    found = learn([session(1, 400), session(2, 400)], KNOWN, JOINTS, ["one", "two"])
    assert found.sessions == ("one", "two") and found.names == tuple(each.name for each in KNOWN[:3])
    sigmas = np.sqrt(np.diag(found.covariance))
    assert np.abs((np.array(found.mean) - THETA[:3]) / sigmas).max() < 2.5
    assert np.all(sigmas < 2.0 * np.array([each.healthy for each in KNOWN[:3]])), "four times the variance, at most"
    assert sigmas[0] < 0.01 and abs(found.mean[0] - 0.03) < 0.01
    assert found.angle_error == pytest.approx(2e-4, rel=0.35) and found.force_error == pytest.approx(0.02, rel=0.35)


@pytest.mark.slow
def test_it_is_taken_over():
    found = learn([session(3, 700)], KNOWN, JOINTS, ["one"])
    mean, covariance = found.healthy(KNOWN)
    assert mean[:3].tolist() == found.mean and mean[3] == covariance[3, 3] == 0.0
    assert np.linalg.eigvalsh(covariance).min() > -1e-15


@pytest.mark.slow
def test_larger_errors_are_told_from_smaller():
    small, large = (learn([session(4, 650, error)], KNOWN, JOINTS, ["one"]).angle_error for error in (1e-4, 8e-4))
    assert 4.0 < large / small < 16.0


@pytest.mark.parametrize("sessions", [[], [[]], [session(1, 100), session(2, 100)]])
def test_too_short(sessions):
    with pytest.raises(UsageError, match=rf"too short to learn from\. Give at least {LEAST:.0f} s, with moves"):
        learn(sessions, KNOWN, JOINTS, [str(i) for i in range(len(sessions))])


def test_frequencies_of_holds_narrow_the_parameters():
    """A stiffness that lowers a frequency is learnt from holds, with the error of the model that was drawn."""
    rng, place, sessions = np.random.default_rng(6), 0, []
    for seed in (1, 2):
        problems = session(seed, 300)
        for k in range(10, 300, 20):
            slopes = np.zeros((2, len(KNOWN)))
            slopes[:, place] = [-0.2, -0.05]
            off = slopes @ THETA + 0.0025 * rng.normal(size=2)
            rows, none = np.column_stack([off, slopes]), np.zeros(0)
            hold = HoldProblem(k, k, none, none, none, np.arange(2), rows, np.full(2, 1e-4), none)
            problems[k] = problems[k]._replace(hold=hold)
        sessions.append(problems)
    regression = Regression(*Baseline().healthy(KNOWN))
    holds = [problem.hold for problems in sessions for problem in problems if problem.hold is not None]
    learnt = _learn_frequencies(holds, regression, Baseline())
    assert learnt.frequency_error == 0.0025
    sigma = float(np.sqrt(regression.covariance[place, place]))
    assert sigma < 0.3 * KNOWN[place].healthy and abs(regression.mean[place] - THETA[place]) < 3.0 * sigma
