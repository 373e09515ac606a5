"""Test of holds: what means of residuals and natural frequencies of many holds say together of faults.

A section that is softer turns the tip by a milliradian and lowers a natural frequency by two percent: in a block of 0.1 s that
is nothing, and a filter that allows for the model's error of a posture follows it. Over holds it adds up. The rows of all holds
are one Gaussian problem: the model's error of each channel and of each frequency is correlated over postures as in
`boom_twin.health.inference.innovation_filter`, healthy parameters are those of the baseline, and a fault is there from any of
the holds on; those before tell what this rig is like while all is well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..types import NANO, Array
from .inference.holds import HoldProblem
from .inference.hypotheses import Evidence, HypothesisTest, Verdict
from .inference.innovation_filter import REACH, REST

MOST = 12  # holds that are kept
BENT = 0.1  # share of a deviation of a frequency by which its derivative may be wrong
FAR, LIKELY, DOUBTED = 0.01, 4.6, 2.3  # m at the tip, ln of a hundred and of ten to one: see `HoldVerdict.is_far`


@dataclass(frozen=True)
class HoldVerdict:
    """What all holds say.

    Attributes
    ----------
    since : int
        Stamp (ns) of the first hold with the fault.
    verdict : Verdict
    tip : float
        By how much the most probable fault puts the tip off in the newest hold, m.
    is_far : bool
        Whether that is `FAR` or more, such a fault is more probable than none by e^`LIKELY`, and the holds before the newest
        said the same by e^`DOUBTED`: a single one does not count. A baseline that allows much explains much, so that no fault
        becomes certain; the tip is off all the same.
    """

    since: int
    verdict: Verdict
    tip: float
    is_far: bool = False


def rows_of(hold: HoldProblem, errors2: Array, frequency_error: float) -> tuple[Array, Array, Array]:
    """Rows of a hold (k, 1 + parameters), variances of their own (k,), and variances of the model's error in them (k,)."""
    table = np.vstack([hold.table, hold.frequencies])
    own = np.concatenate([hold.unrest**2, hold.sigmas**2 + (BENT * hold.frequencies[:, 0]) ** 2])
    return table, own, np.concatenate([errors2, np.full(len(hold.modes), frequency_error**2)])


class HoldTest:
    """Keeps the newest holds and weighs faults.

    Parameters
    ----------
    bank : HypothesisTest
    errors2 : ndarray, shape (channels,)
        Variance of the model's error in one posture.
    frequency_error : float
        Relative error of the model's frequencies.
    """

    def __init__(self, bank: HypothesisTest, errors2: Array, frequency_error: float) -> None:
        self._bank, self._errors2, self._frequency_error = bank, errors2, frequency_error
        self.restart(())

    def restart(self, known: Sequence[tuple[int, float]]) -> None:
        """Forget all holds.

        Parameters
        ----------
        known : sequence of (int, float)
            The faults that are known from now on: places of their parameters, and standard deviations of what their signatures
            leave, in the parameters' units: what these say of large faults is crude, and no further fault.
        """
        self._holds: list[HoldProblem] = []
        self._before: HoldVerdict | None = None
        self._known = tuple(known)

    @property
    def telling(self) -> HoldProblem:
        """The newest hold that gave a frequency, or else the newest; there is at least one."""
        return next((hold for hold in reversed(self._holds) if len(hold.modes)), self._holds[-1])

    def take(self, hold: HoldProblem, mean: Array, covariance: Array) -> HoldVerdict:
        """A further hold; gives what all say of parameters that are healthy about a mean (parameters,)."""
        self._holds = [*self._holds, hold][-MOST:]
        white, log, numbers = self._whitened()
        best: HoldVerdict | None = None
        for first, start in enumerate(self._holds):
            since = numbers >= first
            verdict = self._explained(white, since, log, mean, covariance)
            if best is None or verdict.strength > best.verdict.strength:
                found = verdict.best
                best = HoldVerdict(start.start, verdict, float(np.hypot(*hold.tip[:, found.place]) * abs(found.value)))
        assert best is not None
        before, self._before = self._before, best
        was_far = before is not None and before.tip >= FAR and before.verdict.strength >= DOUBTED
        return replace(best, is_far=was_far and best.tip >= FAR and best.verdict.strength >= LIKELY)

    def is_of_one_frequency(self, found: HoldVerdict, mean: Array, covariance: Array) -> bool:
        """Whether no fault is more probable than none by e^`LIKELY` without a certain frequency of a certain hold.

        Two vibrations that were taken for one, or one of second order that was taken for a mode, put a single one off by 5 %.
        """
        return any(each.strength < LIKELY for each in self._verdicts_without(found, self._frequencies(), mean, covariance))

    def is_borne_out(self, found: HoldVerdict, mean: Array, covariance: Array) -> bool:
        """Whether the most probable cause stays that, by e^`LIKELY`, whichever single frequency or single hold is left out.

        A wind that was not noticed makes one as wrong as a fault does, and mean and frequencies of a hold together. So does a
        fault that begins within a hold.
        """
        if len(self._holds) == 1:
            return False
        each_hold = self._rows()[1] == np.arange(len(self._holds))[:, None]
        name = found.verdict.causes[0].name
        verdicts = self._verdicts_without(found, [*self._frequencies(), *each_hold], mean, covariance)
        return all(each.causes[0].name == name and each.strength >= LIKELY for each in verdicts)

    def _frequencies(self) -> list[NDArray[np.bool_]]:
        """Of every frequency its row among those of all holds."""
        rows = self._rows()[0]
        return list(np.eye(len(rows), dtype=bool)[rows >= len(self._errors2)])

    def _verdicts_without(
        self, found: HoldVerdict, parts: Sequence[NDArray[np.bool_]], mean: Array, covariance: Array
    ) -> Iterator[Verdict]:
        """What all holds say of faults that are there since then, without each of these parts of their rows."""
        first = sum(hold.start < found.since for hold in self._holds)
        for left_out in parts:
            white, log, numbers = self._whitened(left_out)
            yield self._explained(white, numbers >= first, log, mean, covariance)

    def change(self, place: int, by: float, mean: Array, covariance: Array) -> float:
        """ln of how much more probable it is that a parameter has changed by exactly `by`, from any hold on, than not."""
        white, log, numbers = self._whitened()
        found = [self._evidence(white, numbers >= first, log, mean, covariance) for first in range(len(self._holds))]
        return max(float(by * each.vector[0, place] - 0.5 * by**2 * each.matrix[0, place, place]) for each in found)

    def _explained(
        self, white: tuple[Array, Array, Array], since: NDArray[np.bool_], log: float, mean: Array, covariance: Array
    ) -> Verdict:
        """All faults that are there in the rows `since` (k,)."""
        none = np.zeros(0), np.zeros((0, 0))
        return self._bank.explain(self._evidence(white, since, log, mean, covariance), *none, 1.0, {})

    def _evidence(
        self, white: tuple[Array, Array, Array], since: NDArray[np.bool_], log: float, mean: Array, covariance: Array
    ) -> Evidence:
        """What all rows say of faults that are there in the rows `since` (k,), healthy deviations integrated out."""
        (root, left, signature), count = white, len(mean)
        faulty = np.linalg.solve(root, np.where(since[:, None], root @ signature, 0.0))
        rows = np.column_stack([left, signature, faulty])[None]
        healthy = Evidence.of(rows, np.array([log])).given(mean, covariance)
        size = self._bank.coefficient_count
        matrix, vector = np.zeros((1, size, size)), np.zeros((1, size))
        matrix[:, :count, :count], vector[:, :count] = healthy.matrix[:, count:, count:], healthy.vector[:, count:]
        return Evidence(matrix, vector, healthy.squares, healthy.rows, healthy.log)

    def _rows(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Of every row of all holds the channel, or the number of channels and the mode's number; and its hold."""
        channels = np.arange(len(self._errors2))
        what = [np.concatenate([channels, len(channels) + hold.modes]) for hold in self._holds]
        return np.concatenate(what), np.repeat(np.arange(len(self._holds)), [len(each) for each in what])

    def _whitened(self, left_out: NDArray[np.bool_] | None = None) -> tuple[tuple[Array, Array, Array], float, Array]:
        """Root of the covariance, whitened residuals and signatures, logarithm of their probability, hold of every row.

        `left_out`: rows among those of all holds that do not count.
        """
        parts = [rows_of(hold, self._errors2, self._frequency_error) for hold in self._holds]
        table, own, error2 = (np.concatenate(column) for column in zip(*parts, strict=True))
        for place, left in self._known:
            error2 += (left * table[:, 1 + place]) ** 2
        what, numbers = self._rows()
        strokes, times = np.array([hold.strokes for hold in self._holds]), np.array([hold.start for hold in self._holds]) * NANO
        travel = np.abs(strokes[:, None] - strokes[None]).max(axis=2) + REST * np.abs(times[:, None] - times[None])
        known = np.isfinite(table[:, 0])
        if left_out is not None:
            known &= ~left_out
        table, own, error2, what, numbers = table[known], own[known], error2[known], what[known], numbers[known]
        alike = (what[:, None] == what[None]) * np.exp(-travel / REACH)[np.ix_(numbers, numbers)]
        covariance = np.diag(own) + alike * np.sqrt(np.outer(error2, error2))
        root = np.linalg.cholesky(covariance)
        white = np.linalg.solve(root, table)
        log = -0.5 * float(white[:, 0] @ white[:, 0]) - float(np.log(np.diag(root)).sum())
        return (root, white[:, 0], white[:, 1:]), log, numbers
