"""Watches residuals for lasting deviations, and explains them: one alarm at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..analysis.noise import StrokeNoise
from ..records import Alarm, Array, Mount
from ..scene.parts import Scene
from ..settings import Settings
from .bank import Bank, Verdict
from .baseline import Baseline
from .blocks import BLOCK, NANO
from .case import Case
from .detection import Detector
from .linear import Linear, Means, Problem
from .parameters import parameters
from .regression import Regression
from .signatures import Signature
from .whitening import Whitening
from .words import Teller

SUSPICIOUS, CLEAN = 0.25, 0.05  # levels at which a case is begun, and given up if it has not become an alarm
SKIPPED = 2  # blocks in which a fault may still be on its way
ENOUGH, PERIOD = 2, 5  # blocks before the first look at a case, and between two looks at a case
SURE = 15.0  # ln of how much more probable a fault must be than none


class ResidualWatch:
    """See the module.

    Parameters
    ----------
    scene : Scene
        With its load.
    settings : Settings
    mounts : tuple of Mount or None
    baseline : Baseline
    names : tuple of str
        Of the channels.

    Attributes
    ----------
    alarm : Alarm or None
        The one that lasts.
    surprise : ndarray, shape (channels,)
        What the newest block leaves that healthy deviations do not explain; of unit variance, NaN where nothing was measured.
    covariance : ndarray, shape (parameters, parameters)
        Of the parameters while all is well, as the baseline has it.
    listener : callable or None
        Is told every linear problem; what a baseline is learnt from.
    """

    def __init__(
        self, scene: Scene, settings: Settings, mounts: tuple[Mount | None, ...], baseline: Baseline, names: tuple[str, ...]
    ) -> None:
        known, n = parameters(scene), len(scene.joints)
        self._names, self._count = names, len(known)
        self._linear = Linear(scene, settings, mounts, known)
        mean, self.covariance = baseline.healthy(known)
        self._errors2, self._noise2, self._detuning = baseline.errors(n) ** 2, baseline.noise(n) ** 2, baseline.detuning
        self._bank = Bank(known)
        self._tell = Teller(scene, known, self._linear.signatures, baseline.errors(n))
        self._regression = Regression(mean, self.covariance)
        self._detector = Detector(len(names), BLOCK * NANO, settings.false_alarms / 86400.0)
        self.surprise = np.full(len(names), np.nan)
        self.listener: Callable[[Problem], object] | None = None
        self.begin()

    def begin(self) -> None:
        """The boom starts from rest: what moved is forgotten, what is known of its parameters is kept."""
        channels, size, block = len(self._names), 1 + self._count, BLOCK * NANO
        self._healthy = Whitening(channels, size, block, self._detuning)
        self._linear.begin()
        self._detector.reset()
        self._case: Case | None = None
        self._blocks = 0
        self.alarm: Alarm | None = None

    @property
    def levels(self) -> Array:
        """How near each channel is to an alarm, 1 and above while there is one; shape (channels,)."""
        return self._detector.levels

    @property
    def signature(self) -> Signature | None:
        """At the present posture."""
        return self._linear.signature

    def take(self, block: Means, noise: StrokeNoise) -> Alarm | None:
        """Take one block; gives the alarm if it began, changed or ended."""
        problem = self._linear.take(block, noise)
        if problem is None or not np.isfinite(block.left).any():
            return None
        if self.listener is not None:
            self.listener(problem)
        self._watch(problem)
        if self._case is not None and problem.start >= self._case.start:
            self._case.take(problem)
        if self.alarm is None:
            return self._open(block.start)
        self._blocks += 1
        return self._go_on(block.start) if self._blocks % PERIOD == 0 else None

    def _watch(self, problem: Problem) -> None:
        """Innovations beyond what healthy parameters explain; the first suspicious one begins a case."""
        self._healthy.tune(problem.modes)
        noise = problem.noise(self._noise2)
        found = self._healthy.step(problem.table, noise, self._errors2, problem.shaking, problem.travel)
        known = self._regression.mean, self._regression.covariance
        left, _ = self._regression.take(found.white, self.alarm is None)
        self.surprise = np.full(len(self._names), np.nan)
        self.surprise[np.isfinite(problem.table[:, 0])] = left
        if self.alarm is not None:
            return
        self._detector.take(self.surprise)
        if self._regression.has_strayed:  # too slowly for the detector; now it will be told at once
            self._regression.restart()
            self._case = None
        if self._case is None and self._detector.suspicion > SUSPICIOUS:
            assert self._linear.epoch is not None
            start = problem.start + SKIPPED * BLOCK
            self._case = Case(self._bank, start, *known, self._errors2, self._noise2, self._linear.epoch)

    # -- suspicion, alarm, end ------------------------------------------------------------------------------------------

    def _open(self, start: int) -> Alarm | None:
        """An alarm where the detector says so, if a fault explains the case better than none."""
        if self._case is None or self._detector.suspicion < CLEAN:
            self._case = None
            return None
        levels = self.levels
        channel = int(np.argmax(levels))
        if levels[channel] < 1.0 or start < self._case.start + ENOUGH * BLOCK:
            return None
        verdict = self._case.explain()
        if verdict.strength < SURE:
            self._detector.reset(np.arange(len(levels)) == channel)
            return None
        since = start - (self._detector.blocks_since(channel) - 1) * BLOCK
        self.alarm, self._blocks = Alarm(self._names[channel], "residual", since, None, None, ""), 0
        return self._told(verdict)

    def _go_on(self, start: int) -> Alarm | None:
        """Go on with an alarm: other causes may become likely, or it may end."""
        assert self._case is not None
        verdict = self._case.explain()
        return self.close(start) if self._case.has_ended(verdict) else self._told(verdict)

    def forget(self) -> None:
        """Drop a suspicion that is not yet an alarm: a sensor has turned out to be faulty, and may have caused it."""
        if self.alarm is None:
            self._case = None
            self._detector.reset()

    def close(self, stamp: int) -> Alarm | None:
        """End the alarm, if there is one."""
        if self.alarm is None:
            return None
        ended = replace(self.alarm, until=stamp)
        self.alarm, self._case = None, None
        self._detector.reset()
        return ended

    def _told(self, verdict: Verdict) -> Alarm:
        assert self.alarm is not None
        self.alarm = self._tell.alarm(self.alarm, verdict, self.signature)
        return self.alarm
