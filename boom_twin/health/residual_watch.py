"""Watches residuals for lasting deviations, and explains them: one alarm at a time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..analysis.noise import StrokeNoise
from ..records import Alarm, Array, Mount
from ..scene.parts import Scene
from ..settings import Settings
from .bank import Bank, Evidence, Verdict
from .baseline import Baseline
from .blocks import BLOCK, NANO
from .detection import Detector
from .episode import BIN, Bin, Case, Ledger
from .linear import Linear, Means, Problem
from .parameters import hypotheses, parameters
from .regression import Regression
from .signatures import Signature
from .whitening import Modes, Whitening
from .words import Teller

FAULTY_DETUNING = 0.4  # share by which a fault may change natural frequencies
CRUDE = 0.07  # share of a deviation by which its signature, a derivative, may be wrong
LEVEL = 2.0  # s, over which the size of a deviation is taken for that
UNKNOWN_TIMES = 30.0  # deviation of an unknown fault over that of the model's error
RECENT = 20  # bins over which an alarm is held or given up, 10 s
SURE = 15.0  # ln of how much more probable a fault must be than none
GONE = 3.0  # likewise, below which it has ended


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
    """

    def __init__(
        self, scene: Scene, settings: Settings, mounts: tuple[Mount | None, ...], baseline: Baseline, names: tuple[str, ...]
    ) -> None:
        known, n = parameters(scene), len(scene.joints)
        self._names, self._count = names, len(known)
        self._linear = Linear(scene, settings, mounts, known)
        mean, self.covariance = baseline.healthy(known)
        self._errors, self._noise2, self._detuning = baseline.errors(n), baseline.noise(n) ** 2, baseline.detuning
        self._bank = Bank(known, hypotheses(known))
        self._tell = Teller(scene, known, self._linear.signatures, self._errors)
        self._regression = Regression(mean, self.covariance)
        self._detector = Detector(len(names), BLOCK * NANO, settings.false_alarms / 86400.0)
        self.surprise = np.full(len(names), np.nan)
        self.begin()

    def begin(self) -> None:
        """The boom starts from rest: what moved is forgotten, what is known of its parameters is kept."""
        channels, size, block = len(self._names), 1 + self._count, BLOCK * NANO
        self._healthy = Whitening(channels, size, block, self._detuning)
        self._faulty = Whitening(channels, size, block, max(FAULTY_DETUNING, self._detuning))
        self._unknown = Whitening(channels, 1, block, max(FAULTY_DETUNING, self._detuning))
        self._linear.begin()
        self._modes: Modes | None = None
        self._size = np.zeros(channels)
        self._ledger = Ledger()
        self._detector.reset()
        self._case: Case | None = None
        self._recent: list[Bin] = []
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
        measured = np.isfinite(block.left)
        if problem is None or not measured.any():
            return None
        known = self._regression.mean.copy(), self._regression.covariance.copy()
        evidence = self._weigh(problem, measured)
        full = self._ledger.add(evidence, block.start, known)
        if self._case is None:
            return self._open(block.start)
        return None if full is None else self._go_on(full)

    def _weigh(self, problem: Problem, measured: Array) -> Evidence:
        """Innovations of healthy, faulty and unknown booms; the first are watched, the others are evidence."""
        if problem.modes is not self._modes:
            self._modes = problem.modes
            for each in (self._healthy, self._faulty, self._unknown):
                each.tune(problem.modes)
        noise, small = np.diag(problem.own * self._noise2) + problem.strokes, self._errors**2
        shaking, travel = problem.shaking, problem.travel
        healthy = self._healthy.step(problem.table, noise, small, shaking, travel)
        crude = small + (CRUDE * self._size) ** 2
        faulty = self._faulty.step(problem.table, noise, crude, shaking, travel)
        unknown = self._unknown.step(problem.table[:, :1], noise, UNKNOWN_TIMES**2 * small, shaking, travel)
        left = problem.table[measured, 0]
        self._size[measured] += BLOCK * NANO / LEVEL * (left - self._size[measured])
        self.surprise = np.full(len(self._names), np.nan)
        self.surprise[measured], _ = self._regression.take(healthy.white, self._case is None)
        if self._case is None:
            self._detector.take(self.surprise)
        return Evidence.of(faulty.white, faulty.log, unknown.log)

    # -- suspicion, alarm, end ------------------------------------------------------------------------------------------

    def _open(self, start: int) -> Alarm | None:
        """A case where the detector says so, if a fault explains it better than none."""
        levels = self._detector.levels
        channel = int(np.argmax(levels))
        if levels[channel] < 1.0:
            return None
        self._ledger.finish()
        bins, since = self._ledger.bins, self._detector.blocks_since(channel)
        case = self._case_of(list(bins)[-min(since // BIN + 2, len(bins)) :])
        verdict = case.explain()
        if verdict.strength < SURE:
            self._detector.reset(np.arange(len(levels)) == channel)
            return None
        self._case, self._recent = case, []
        began = max(start - since * BLOCK, case.start)
        self.alarm = Alarm(self._names[channel], "residual", began, None, None, "")
        return self._told(verdict)

    def _go_on(self, full: Bin) -> Alarm | None:
        """Go on with an alarm: other causes may become likely, or it may end."""
        assert self._case is not None
        self._case.add(full)
        self._recent = [*self._recent, full][-RECENT:]
        return self.close(full.start) if self._has_ended() else self._told(self._case.explain())

    def _has_ended(self) -> bool:
        """Whether the last seconds need no fault to be explained."""
        assert self._case is not None
        if len(self._recent) < RECENT:
            return False
        first = self._recent[0]._replace(mean=self._case.mean, covariance=self._case.covariance)
        return self._case_of([first, *self._recent[1:]]).explain().strength < GONE

    def _case_of(self, bins: list[Bin]) -> Case:
        assert self._linear.epoch is not None
        return Case(self._bank, bins, self._linear.epoch)

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
