"""A suspicion, and the alarm it may become: everything that is measured from its beginning, weighed by a bank of hypotheses."""

from __future__ import annotations

from collections import deque

import numpy as np

from ..records import Array
from .bank import Bank, Evidence, Verdict
from .blocks import BLOCK, NANO
from .linear import CALM, Problem
from .parameters import Form, Parameter
from .whitening import Whitening

DETUNING = 0.4  # share by which a fault may change natural frequencies
CRUDE = 0.07  # share of a deviation by which its signature, a derivative, may be wrong
LEVEL = 2.0  # s, over which the size of a deviation is taken for that
UNKNOWN_TIMES = 30.0  # deviation of an unknown fault over that of the model's error
GONE = -15.0  # ln of how much less probable a fault is than none when it has ended
RECENT = 100  # blocks over which an alarm is held or given up, 10 s


class Case:
    """Weighs faults.

    Parameters
    ----------
    bank : Bank
    start : int
        Stamp (ns) of its first block.
    mean, covariance : ndarray
        Of the parameters while all was well.
    errors2, noise2 : ndarray, shape (channels,)
        Variance of the model's error in one posture, and factor on the variance of the sensors' noise, while all is well.
    clock : int
        Stamp (ns) at which the columns of drifts are 0.
    """

    def __init__(
        self, bank: Bank, start: int, mean: Array, covariance: Array, errors2: Array, noise2: Array, clock: int
    ) -> None:
        self._bank, self.start, self._mean, self._covariance = bank, start, mean, covariance
        self._errors2, self._noise2 = errors2, noise2
        channels, block = len(errors2), BLOCK * NANO
        self._faulty = Whitening(channels, 1 + len(mean), block, DETUNING)
        self._unknown = Whitening(channels, 1, block, DETUNING)
        self._size, self._beyond = np.zeros(channels), 0.0
        self._evidence, self._span = Evidence.none(len(mean)), 0.0
        self._recent: deque[Evidence] = deque(maxlen=RECENT)
        self._turn = drifts_from(bank.known, (start - clock) * NANO)

    def take(self, problem: Problem) -> None:
        """Take one block."""
        self._faulty.tune(problem.modes)
        self._unknown.tune(problem.modes)
        left = problem.table[:, 0]
        measured = np.isfinite(left)
        self._size[measured] += BLOCK * NANO / LEVEL * (left[measured] - self._size[measured])
        shaking = self._shaking(problem)
        self._span = (problem.start - self.start) * NANO
        noise = problem.noise(self._noise2)
        crude = self._errors2 + (CRUDE * self._size) ** 2
        faulty = self._faulty.step(problem.table, noise, crude, shaking, problem.travel)
        large = UNKNOWN_TIMES**2 * self._errors2
        unknown = self._unknown.step(problem.table[:, :1], noise, large, shaking, problem.travel)
        found = Evidence.of(faulty.white, faulty.log, unknown.log)
        self._evidence = self._evidence + found
        self._recent.append(found)

    def _shaking(self, problem: Problem) -> float:
        """Mean square of the tip's acceleration: what is predicted, and what the IMU reads beyond that."""
        beyond = np.nansum((problem.table[-2:, 0] - self._size[-2:]) ** 2)
        self._beyond = max(self._beyond * float(np.exp(-BLOCK * NANO / CALM)), float(beyond))
        return problem.shaking + self._beyond

    def explain(self) -> Verdict:
        """Weigh all hypotheses; drifts begin with the case."""
        return self._bank.explain(self._evidence.turned(self._turn), self._mean, self._covariance, self._span)

    def has_ended(self, verdict: Verdict) -> bool:
        """Whether the last seconds speak against the fault that explains all of the case best."""
        if len(self._recent) < RECENT:
            return False
        recently = sum(self._recent, Evidence.none(len(self._mean))).turned(self._turn)
        return self._bank.support(recently, verdict.best, self._mean, self._covariance) < GONE


def drifts_from(known: tuple[Parameter, ...], time: float) -> Array:
    """Makes every drift begin at `time` (s): its column less `time` times that of the bias; shape (parameters, parameters)."""
    turn = np.eye(len(known))
    bias = {each.index: i for i, each in enumerate(known) if each.form is Form.ANGLE}
    for i, each in enumerate(known):
        if each.form is Form.DRIFT:
            turn[bias[each.index], i] = -time
    return turn
