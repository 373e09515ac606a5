"""From a block to a linear problem: residuals, signatures of all parameters, noise, and modes at the posture of the block."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..analysis.noise import StrokeNoise
from ..records import Array, Mount
from ..scene.parts import Scene
from ..settings import Settings
from .blocks import BLOCK, NANO
from .parameters import Form, Parameter
from .signatures import Signature, Signatures
from .whitening import Modes, modes_of

STEP = 0.01  # m of stroke after which signatures are made anew
CALM = 2.0  # s, over which the shaking of the tip is remembered
SMOOTHED = 0.5  # of the variance of a stroke's estimate, what is left of it in the mean of a block


@dataclass(frozen=True)
class Means:
    """One block as residuals have it.

    Attributes
    ----------
    start : int
        ns.
    left : ndarray, shape (channels,)
        Means of the residuals, NaN where nothing was measured or the sensor is not to be trusted.
    counts : ndarray, shape (channels,)
        Of the values in each mean.
    strokes, variances, rates : ndarray, shape (n,)
        As estimated, m; variance of these estimates, m^2; rates of the predicted angles, rad/s.
    shaking : float
        Mean square of the predicted tip acceleration, (m/s^2)^2.
    """

    start: int
    left: Array
    counts: Array
    strokes: Array
    variances: Array
    rates: Array
    shaking: float


class Problem(NamedTuple):
    """One block, linearised; c channels.

    Attributes
    ----------
    start : int
        ns.
    table : ndarray, shape (c, 1 + parameters)
        Residuals, and signatures of the parameters.
    own, strokes : ndarray, shape (c,), (c, c)
        Covariance of the residuals: by the noise of the sensors themselves (its diagonal), and by that of the strokes.
    shaking, travel : float
        Mean square of the predicted tip acceleration lately, (m/s^2)^2; travel of the strokes since the block before, m.
    modes : Modes
    """

    start: int
    table: Array
    own: Array
    strokes: Array
    shaking: float
    travel: float
    modes: Modes

    def noise(self, factors2: Array) -> Array:
        """Covariance (c, c) of the residuals where the sensors' own noise is `factors2` (c,) times as strong in power."""
        return np.asarray(np.diag(self.own * factors2) + self.strokes)


class Linear:
    """Follows the posture.

    Parameters
    ----------
    scene : Scene
        With its load.
    settings : Settings
    mounts : tuple of Mount or None
    known : tuple of Parameter

    Attributes
    ----------
    signatures : Signatures
    signature : Signature or None
        At the newest block; None before the first.
    epoch : int or None
        Stamp (ns) at which the columns of drifts are 0.
    """

    def __init__(
        self, scene: Scene, settings: Settings, mounts: tuple[Mount | None, ...], known: tuple[Parameter, ...]
    ) -> None:
        n = len(scene.joints)
        self.signatures = Signatures(scene, known, mounts)
        self._sensor2 = np.array([settings.angle_variance] * n + [settings.imu_sigma**2] * 2)
        self._drifts = [(i, each.index) for i, each in enumerate(known) if each.form is Form.DRIFT]
        self._late = [i for i, each in enumerate(known) if each.form is Form.DELAY]
        self.begin()

    def begin(self) -> None:
        """The boom starts from rest."""
        self.signature: Signature | None = None
        self.epoch: int | None = None
        self._tuned: StrokeNoise | None = None
        self._modes: Modes | None = None
        self._before: Array | None = None
        self._shaking = 0.0

    def take(self, block: Means, noise: StrokeNoise) -> Problem | None:
        """One block; None while there is no equilibrium to linearise about."""
        if self.epoch is None:
            self.epoch = block.start
        if self.signature is None or np.abs(block.strokes - self.signature.strokes).max() > STEP:
            self.signature = self.signatures.at(block.strokes) or self.signature
        if self.signature is None:
            return None
        if noise is not self._tuned:
            boom, self._tuned = self.signatures.nominal, noise
            self._modes = modes_of(noise, boom.plan, boom.state, boom.work, boom.reading, BLOCK * NANO, self._modes)
        travel = 0.0 if self._before is None else float(np.abs(block.strokes - self._before).max())
        shaking, self._before = self._shaking, block.strokes
        self._shaking = max(self._shaking * np.exp(-BLOCK * NANO / CALM), block.shaking)
        own = self._sensor2 / np.maximum(block.counts, 1.0)
        by = self.signature.by_stroke
        spread = (by * (SMOOTHED * block.variances)) @ by.T
        assert self._modes is not None
        return Problem(block.start, self._table(block, self.signature), own, spread, shaking, travel, self._modes)

    def _table(self, block: Means, signature: Signature) -> Array:
        assert self.epoch is not None
        table = np.column_stack([block.left, signature.channels])
        for column, row in self._drifts:
            table[row, 1 + column] = (block.start - self.epoch) * NANO
        for column in self._late:
            table[: len(block.rates), 1 + column] = -block.rates
        return table
