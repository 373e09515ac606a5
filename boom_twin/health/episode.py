"""From the first suspicion to the end of an alarm: what is known about one fault that shows in the residuals."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..records import Array
from .bank import Bank, Evidence, Verdict
from .parameters import Form, Parameter

BIN = 10  # blocks
KEPT = 40  # bins: how far back a fault may have begun, 20 s


class Bin(NamedTuple):
    """Half a second: when it began (ns), what it says, and what was known of the parameters then."""

    start: int
    evidence: Evidence
    mean: Array
    covariance: Array


class Ledger:
    """The last bins, and the one that is being filled."""

    def __init__(self) -> None:
        self.bins: deque[Bin] = deque(maxlen=KEPT)
        self._open: Bin | None = None
        self._blocks = 0

    def add(self, evidence: Evidence, start: int, known: tuple[Array, Array]) -> Bin | None:
        """Take one block that began at `start` (ns); gives a bin when it is full."""
        self._open = Bin(start, evidence, *known) if self._open is None else self._open._replace(
            evidence=self._open.evidence + evidence
        )  # fmt: skip
        self._blocks += 1
        return self.finish() if self._blocks == BIN else None

    def finish(self) -> Bin | None:
        """Close the bin that is being filled."""
        full, self._open, self._blocks = self._open, None, 0
        if full is not None:
            self.bins.append(full)
        return full


class Case:
    """What has been measured since a fault is thought to have begun, weighed by a bank.

    Parameters
    ----------
    bank : Bank
    bins : sequence of Bin
        Since then; the first one tells what was known of the parameters before.
    clock : int
        Stamp (ns) at which the columns of drifts are 0.
    """

    def __init__(self, bank: Bank, bins: Sequence[Bin], clock: int) -> None:
        self._bank, self.start = bank, bins[0].start
        self.mean, self.covariance = bins[0].mean, bins[0].covariance
        self._evidence = Evidence.none(len(self.mean))
        self._turn = drifts_from(bank.known, (self.start - clock) * 1e-9)
        for each in bins:
            self.add(each)

    def add(self, new: Bin) -> None:
        """Take another bin."""
        self._evidence = self._evidence + new.evidence

    def explain(self) -> Verdict:
        """Weigh all hypotheses; drifts begin with the case."""
        return self._bank.explain(self._evidence.turned(self._turn), self.mean, self.covariance)


def drifts_from(known: tuple[Parameter, ...], time: float) -> Array:
    """Makes every drift begin at `time` (s): its column less `time` times that of the bias; shape (parameters, parameters)."""
    turn = np.eye(len(known))
    bias = {each.index: i for i, each in enumerate(known) if each.form is Form.ANGLE}
    for i, each in enumerate(known):
        if each.form is Form.DRIFT:
            turn[bias[each.index], i] = -time
    return turn
