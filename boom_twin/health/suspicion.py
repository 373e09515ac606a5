"""A suspicion: the evidence of the blocks since something began to deviate, under several levels of load at the tip."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..scene.schema import Scene
from ..scene.summary import weight_of
from ..types import NANO, Array
from .alarm_text import FITS, REFUTED
from .hold_test import rows_of
from .inference.block_problem import BLOCK, BlockProblem
from .inference.holds import HoldProblem
from .inference.hypotheses import Evidence, Explanation, HypothesisTest, Verdict
from .inference.innovation_filter import REACH, InnovationFilter

LEVELS = np.array([0.0, 0.0007, 0.0023, 0.0077, 0.026])
"""Of the unknown load at the tip, as shares of the boom's weight: 0, 4.5, 15, 50 and 170 N of the 6.5 kN of the default one."""
DETUNING = 0.15  # share by which a fault may change natural frequencies
SHAKEN = 0.6  # m/s^2 rms of the predicted tip acceleration at which a block counts half for a name: faults change vibration
CRUDE = 0.01  # share of a deviation by which its signature, a derivative, may be wrong
LEVER, LOAD_BLOCKS = 2.0, 10
"""What becomes softer is bent by the load, too: of a deviation by the load's share of the boom's weight, which acts at half the
reach, times the first; for as many blocks on end as the second."""
LEVEL = 2.0  # s, over which the size of a deviation is taken for that
LATELY = 100  # blocks of evidence of which the later half is looked at for the end of growth
RECENT = 20  # blocks that must go with what explains all of them
MISFIT, WHOLE_MISFIT = 2.5, 1.6  # times the squares that noise leaves, in the recent blocks and in all of them
SURE = 15.0  # ln of how much more probable a fault must be than none for an alarm
EXCITED = 12.0  # ln of how much better another level of load goes with the recent blocks
LONGEST = 900  # blocks of one suspicion
CHANGED = 12.0  # ln of how much better another size of the same fault goes with the recent blocks
SAME = 0.1  # share by which a size that does not grow may seem to change under a load: it bends what has become softer, too
CARRIED = 0.02  # least probability that a cause keeps from one suspicion to the next


def load_levels(scene: Scene) -> Array:
    """Levels (N) that the unknown load at the tip of a boom is looked for at, from 0."""
    return LEVELS * weight_of(scene)


class RecentFit(NamedTuple):
    """How an explanation of all evidence goes with its recent blocks.

    Attributes
    ----------
    is_outdated : bool
        Not any more: the fault or the load has changed. A load that is less than it was refutes no fault: what explained
        the evidence under the larger one still does. Nor does one under which the fault is as plain.
    is_resized : bool
        With another size or rate of the same fault much better than with those that it has by all of the evidence: it has
        grown, or grows no more (for that the later half of the evidence counts, too). What such evidence says of causes
        depends on which makes up best for the wrong shape.
    """

    is_outdated: bool
    is_resized: bool


class Suspicion:
    """Weighs faults.

    Parameters
    ----------
    bank : HypothesisTest
    start : int
        Stamp (ns) of its first block.
    mean, covariance : ndarray
        Of the parameters while all was well.
    errors2, noise2 : ndarray, shape (channels,)
        Variance of the model's error in one posture, and factor on the variance of the sensors' noise, while all is well.
    levels : ndarray
        Of the load, N; the first is 0.
    detuning : float
        Share by which natural frequencies may be wrong while all is well.
    carried : mapping of str to float
        See `HypothesisTest.explain`.
    """

    def __init__(
        self, bank: HypothesisTest, start: int, mean: Array, covariance: Array, errors2: Array, noise2: Array, levels: Array,
        detuning: float, carried: Mapping[str, float],
    ) -> None:  # fmt: skip
        self._bank, self.start, self.mean, self.covariance = bank, start, mean, covariance
        self._errors2, self._noise2, self._carried = errors2, noise2, carried
        self._faulty, self._healthy = slice(len(levels)), slice(len(levels), None)  # levels by filters of DETUNING, and not
        self._shares = np.tile(LEVELS[: len(levels)], 2)
        detunings, levels = np.repeat([DETUNING, detuning], len(levels)), np.tile(levels, 2)
        channels, coefficients = len(errors2), bank.coefficient_count
        self._filter = InnovationFilter(channels, 1 + coefficients, BLOCK * NANO, detunings, levels)
        self.size, self.blocks, self._travel = np.zeros(channels), 0, 0.0
        self._evidence = Evidence.none(coefficients, levels.shape)
        self._calm = self._evidence.of_levels(self._faulty)
        self._before = deque([self._evidence], maxlen=RECENT + 1)  # after each of the recent blocks, and before them
        self._halfway = deque([self._evidence])  # likewise after every so many blocks, from half of them on

    @property
    def span(self) -> float:
        """Time (s) that the evidence has taken."""
        return self.blocks * BLOCK * NANO

    @property
    def is_settled(self) -> bool:
        """Whether it is old enough to be outdated, see `recent_fit`."""
        return self.blocks > RECENT

    def take(self, problem: BlockProblem, is_shaken: bool) -> None:
        """Take one block; `is_shaken`: a load shakes the boom, so that it bends what has become softer, too."""
        left = problem.table[:, 0]
        measured = np.isfinite(left)
        self.size[measured] += max(BLOCK * NANO / LEVEL, 1.0 / (1 + self.blocks)) * (left[measured] - self.size[measured])
        noise, crude = problem.noise(self._noise2), self._errors2 + (CRUDE * self.size) ** 2
        table = self._with_rates(problem.table, problem.start)
        weight = 1.0 / (1.0 + problem.shaking / SHAKEN**2)
        self._filter.tune(problem.modes)
        self._filter.roughen(is_shaken * LOAD_BLOCKS * np.outer(LEVER * self._shares, self.size) ** 2)
        shaking = self._filter.vibration(problem.shaking)
        white, log = self._filter.step(table, noise, crude, shaking, problem.travel)
        self._evidence = self._evidence.with_rows(white, log)
        self._calm = self._calm.with_rows(white[self._faulty], log[self._faulty], weight)
        self._before.append(self._evidence)
        self.blocks += 1
        if self.blocks % RECENT == 0:
            self._halfway.append(self._evidence)
            if self.blocks // RECENT % 2 == 1:
                self._halfway.popleft()
        self._travel += problem.travel

    def take_hold(self, hold: HoldProblem, frequency_error: float) -> None:
        """Take the natural frequencies of a hold that began since; no load changes them, and no sensor."""
        if hold.start < self.start or not len(hold.modes):
            return
        table, own, error2 = rows_of(hold, self._errors2, frequency_error)
        rows, sigmas = table[len(self._errors2) :], np.sqrt(own + error2)[len(self._errors2) :, None]
        white = self._with_rates(rows, (hold.start + hold.end) // 2) / sigmas
        found = Evidence.of(white[None], np.array([-0.5 * float(white[:, 0] @ white[:, 0]) - float(np.log(sigmas).sum())]))
        self._evidence += found
        self._calm += found

    def _with_rates(self, rows: Array, stamp: int) -> Array:
        """Rows (k, 1 + parameters) at `stamp` (ns), and signatures of the rates of what may grow; (k, 1 + coefficients)."""
        return np.concatenate([rows, (stamp - self.start) * NANO * rows[:, 1 + self._bank.growing]], axis=1)

    @property
    def travel(self) -> float:
        """Of the strokes since it began, m."""
        return self._travel

    def explain(self) -> Verdict:
        """Weigh all hypotheses, whether frequencies may be off as by a fault or only as while all is well: the lesser strength.

        Filters that allow for a fault's frequencies expect too much of vibration of a healthy boom: there, in a gust, a lower
        level of the load with a fault goes better with it than the right one without.
        """
        of_faults, of_none = (self._evidence.of_levels(levels) for levels in (self._faulty, self._healthy))
        return self._explain(of_faults, of_none)

    def explain_calmly(self) -> Verdict:
        """Likewise, but blocks in which the boom vibrates count less: what a cause is named by."""
        return self._explain(self._calm, None)

    def _explain(self, evidence: Evidence, healthy_too: Evidence | None) -> Verdict:
        postures = 1.0 + self._travel / REACH
        return self._bank.explain(evidence, self.mean, self.covariance, self.span, self._carried, postures, healthy_too)

    def least_told(self, level: int, strength: float) -> Array:
        """Least sizes of steady faults, shape (parameters,), that this evidence would tell under a load of that level.

        By the posterior's own covariance: `strength` is ln of how much more probable than none such a fault has to be.
        """
        healthy = self._evidence.of_levels(self._faulty).given(self.mean, self.covariance)
        return self._bank.least_told(healthy.matrix[level].diagonal()[: len(self.mean)], strength)

    def load(self, level: int) -> tuple[float, float]:
        """Magnitude of the force at the tip, and its deviation, N, if there is no fault but a load of this level."""
        forces, covariances = self._filter.load(self.mean, self.covariance)
        force, covariance = forces[level], covariances[level]
        size = float(np.hypot(*force))
        along = force / max(size, 1e-9)
        return size, math.sqrt(float(along @ covariance @ along))

    def recent_fit(self, verdict: Verdict) -> RecentFit:
        """How what explains all of the evidence goes with the recent blocks."""
        if not self.is_settled:
            return RecentFit(False, False)
        recent = (self._evidence + self._before[0].weighted(-1.0)).of_levels(self._faulty)
        about, middle = (self.mean, self.covariance), self.span - 0.5 * RECENT * BLOCK * NANO
        if verdict.strength > 0.0:
            logs, squares, changed, moved = self._bank.change(recent, verdict.best, self.span, middle, *about)
            if verdict.best.is_growing and self.blocks > LATELY:
                lately = (self._evidence + self._halfway[0].weighted(-1.0)).of_levels(self._faulty)
                changed = max(changed, self._bank.change(lately, verdict.best, self.span, middle, *about)[2])
        else:
            (logs, squares), changed, moved = self._bank.fit(recent, self._coefficients(None), *about), 0.0, 0.0
        is_misfit = verdict.excess > WHOLE_MISFIT or squares[verdict.level] > MISFIT
        others = logs[verdict.level :] if verdict.strength >= SURE else logs
        other = len(logs) - len(others) + int(np.argmax(others))
        is_other_load = logs[other] - logs[verdict.level] > EXCITED and not self._is_sure_under(verdict, other)
        is_same = moved < SAME and verdict.level > 1 and not verdict.best.is_growing
        return RecentFit(bool(self.blocks > LONGEST or is_misfit or is_other_load), changed > CHANGED and not is_same)

    def _is_sure_under(self, verdict: Verdict, level: int) -> bool:
        """Whether what explains the evidence would do so under a load of that level, too: then the load makes no difference."""
        if verdict.strength < SURE:
            return False
        evidence, about = self._evidence.of_levels(self._faulty), (self.mean, self.covariance)
        with_fault, _ = self._bank.fit(evidence, self._coefficients(verdict.best), *about)
        none, _ = self._bank.fit(evidence, self._coefficients(None), *about)
        return bool(with_fault[level] - none[level] >= SURE * verdict.excess)

    def _coefficients(self, each: Explanation | None) -> Array:
        return np.zeros(self._bank.coefficient_count) if each is None else self._bank.coefficients(each, self.span)

    def log_factor(self, each: Explanation) -> float:
        """ln of how much more probable a steady fault of exactly this value is than none."""
        evidence, about = self._evidence.of_levels(self._faulty), (self.mean, self.covariance)
        logs, _ = self._bank.fit(evidence, self._bank.coefficients(each, 0.0), *about)
        none, _ = self._bank.fit(evidence, self._coefficients(None), *about)
        return float(logs.max() - none.max())


def carried_on(verdict: Verdict) -> dict[str, float]:
    """What a suspicion that follows this verdict, when it is outdated, is to begin with; see `HypothesisTest.explain`."""
    return {cause.name: math.log(max(cause.probability, CARRIED)) for cause in verdict.causes}


def refuted(verdict: Verdict) -> frozenset[str]:
    """Causes that cannot be that of a deviation which this verdict explains well, whatever comes later."""
    if verdict.excess > FITS:
        return frozenset()
    return frozenset(cause.name for cause in verdict.causes if cause.alone < REFUTED)
