"""Monitor residuals for lasting deviations: suspicion, alarm, and the ranked causes of one alarm at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..analysis.modal import StrokeNoise
from ..config.settings import Settings
from ..scene.schema import Scene
from ..types import NANO, Alarm, Array, Mount
from .alarm_text import AlarmText
from .baseline import Baseline
from .detection import Detector
from .inference.block_problem import BLOCK, CALM, BlockMeans, BlockProblem, LinearModel
from .inference.fault_catalogue import Form, Parameter, parameters
from .inference.hypotheses import Evidence, HypothesisTest, Regression, Verdict
from .inference.innovation_filter import InnovationFilter
from .inference.sensitivities import Signature

DETUNING = 0.4  # share by which a fault may change natural frequencies
CRUDE = 0.07  # share of a deviation by which its signature, a derivative, may be wrong
LEVEL = 2.0  # s, over which the size of a deviation is taken for that
UNKNOWN_TIMES = 30.0  # deviation of an unknown fault over that of the model's error
GONE = -15.0  # ln of how much less probable a fault is than none when it has ended
RECENT = 100  # blocks over which an alarm is held or given up, 10 s


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
    clock : int
        Stamp (ns) at which the columns of drifts are 0.
    """

    def __init__(
        self, bank: HypothesisTest, start: int, mean: Array, covariance: Array, errors2: Array, noise2: Array, clock: int
    ) -> None:
        self._bank, self.start, self._mean, self._covariance = bank, start, mean, covariance
        self._errors2, self._noise2 = errors2, noise2
        channels, block = len(errors2), BLOCK * NANO
        self._faulty = InnovationFilter(channels, 1 + len(mean), block, DETUNING)
        self._unknown = InnovationFilter(channels, 1, block, DETUNING)
        self._size, self._beyond = np.zeros(channels), 0.0
        self._evidence, self._span = Evidence.none(len(mean)), 0.0
        self._recent: deque[Evidence] = deque(maxlen=RECENT)
        self._turn = drifts_from(bank.known, (start - clock) * NANO)

    def take(self, problem: BlockProblem) -> None:
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

    def _shaking(self, problem: BlockProblem) -> float:
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


SUSPICIOUS, CLEAN = 0.25, 0.05  # levels at which a case is begun, and given up if it has not become an alarm
SKIPPED = 2  # blocks in which a fault may still be on its way
ENOUGH, PERIOD = 2, 5  # blocks before the first look at a case, and between two looks at a case
SURE = 15.0  # ln of how much more probable a fault must be than none


class ResidualMonitor:
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
    on_block : callable, optional
        Is told every linear problem; what a baseline is learnt from.

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
        self,
        scene: Scene,
        settings: Settings,
        mounts: tuple[Mount | None, ...],
        baseline: Baseline,
        names: tuple[str, ...],
        on_block: Callable[[BlockProblem], object] | None = None,
    ) -> None:
        known, n = parameters(scene), len(scene.joints)
        self._names, self._count = names, len(known)
        self._linear = LinearModel(scene, settings, mounts, known)
        mean, self.covariance = baseline.healthy(known)
        self._errors2, self._noise2, self._detuning = baseline.errors(n) ** 2, baseline.noise(n) ** 2, baseline.detuning
        self._bank = HypothesisTest(known)
        self._tell = AlarmText(scene, known, self._linear.signatures, baseline.errors(n))
        self._regression = Regression(mean, self.covariance)
        self._detector = Detector(len(names), BLOCK * NANO, settings.false_alarms / 86400.0)
        self.surprise = np.full(len(names), np.nan)
        self._on_block = on_block
        self.begin()

    def begin(self) -> None:
        """The boom starts from rest: what moved is forgotten, what is known of its parameters is kept."""
        channels, size, block = len(self._names), 1 + self._count, BLOCK * NANO
        self._healthy = InnovationFilter(channels, size, block, self._detuning)
        self._linear.begin()
        self._detector.reset()
        self._case: Suspicion | None = None
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

    def take(self, block: BlockMeans, noise: StrokeNoise) -> Alarm | None:
        """Take one block; gives the alarm if it began, changed or ended."""
        problem = self._linear.take(block, noise)
        if problem is None or not np.isfinite(block.left).any():
            return None
        if self._on_block is not None:
            self._on_block(problem)
        self._watch(problem)
        if self._case is not None and problem.start >= self._case.start:
            self._case.take(problem)
        if self.alarm is None:
            return self._open(block.start)
        self._blocks += 1
        return self._go_on(block.start) if self._blocks % PERIOD == 0 else None

    def _watch(self, problem: BlockProblem) -> None:
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
            self._case = Suspicion(self._bank, start, *known, self._errors2, self._noise2, self._linear.epoch)

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
