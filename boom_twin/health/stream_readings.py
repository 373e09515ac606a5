"""What a block of readings of one stream says, worked out once for all that judge it: means, rates, noise, motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import SameTypes, hold
from ..types import Array
from .inference.block_problem import MeasuredRows, PredictionRows
from .sensor_survey import (
    COUNTS,
    MEASURED,
    NEAR,
    NEAR_COUNTS,
    OFF,
    RATES,
    ROOM,
    SLOW_EXPECTED,
    SLOW_READ,
    SLOW_SQUARES,
    SPREAD,
    TURNING,
    WEIGHT,
    ReadingsWork,
    summarise,
    summarise_predictions,
)

_summarise_predictions = SameTypes(summarise_predictions)

SHAKEN = 3.0
"""Variances of a reading in its second differences, by which other sensors bear witness that the boom is shaken and that what
looks like noise in strokes may be motion."""
WHITE = 0.75
"""Share of that variance that third differences must have for noise."""
OUTLIER = 6.0  # deviations of the noise from the median, from which on a reading counts in no mean
LOUDEST, NOISE_SHARE = 100.0, 0.05
"""Times the stated variance that noise is taken for at most; and weight of a block in the variance that is measured."""
WINDOW = 2.0  # s, time constant of the slow means
ENOUGH = 0.6  # of their weight: after 1.8 s


@dataclass(frozen=True, slots=True)
class SlowMeans:
    """Means over the last `WINDOW`; they go on with every block.

    Attributes
    ----------
    read, expected, squares : ndarray, shape (channels,)
        Weighted sums that begin at 0: divided by `weight` they are means of what was read, of what the model had, and of the
        square of the difference; in the unit of the readings.
    weight : ndarray, shape (channels,)
        From 0 to 1.
    """

    read: Array
    expected: Array
    squares: Array
    weight: Array


class StreamReadings(NamedTuple):
    """What a block of k readings says.

    Attributes
    ----------
    rows : MeasuredRows
    numbers : ndarray, shape (6, channels)
        What follows, by `boom_twin.health.sensor_survey.COUNTS`.
    slow : SlowMeans
    is_bent : bool
        Whether trusted sensors tell of a motion that is quick against their rate. Noise gives the same variance by second and
        by third differences, motion much less by third ones.
    """

    rows: MeasuredRows
    numbers: Array
    slow: SlowMeans
    is_bent: bool

    @property
    def counts(self) -> Array:
        """Of the readings that the model has something to compare with, shape (channels,)."""
        return np.asarray(self.numbers[COUNTS])

    @property
    def off(self) -> Array:
        """Mean by which these are off, in their unit; 0 of none; shape (channels,)."""
        return np.asarray(self.numbers[OFF])

    @property
    def near(self) -> Array:
        """The same without outliers, NaN of none."""
        return np.asarray(self.numbers[NEAR])

    @property
    def near_counts(self) -> Array:
        """Of how many readings that is the mean."""
        return np.asarray(self.numbers[NEAR_COUNTS])

    @property
    def rates(self) -> Array:
        """Of what the model expects from the first reading to the last, per s; NaN of fewer than two; shape (channels,)."""
        return np.asarray(self.numbers[RATES])


class StreamSurvey:
    """Goes through the readings of one stream, block by block.

    Parameters
    ----------
    variance : float
        Of the noise of a reading, as stated.
    channels : int

    Attributes
    ----------
    noise2 : ndarray, shape (channels,)
        The same as measured, by second differences.
    """

    def __init__(self, variance: float, channels: int) -> None:
        limits = np.array([variance, SHAKEN, WHITE, OUTLIER * variance**0.5, LOUDEST * variance, NOISE_SHARE])
        self.noise2 = np.full(channels, variance)
        self._numbers, slow = np.zeros((6, channels)), np.zeros((4, channels))
        self._work = ReadingsWork(limits, self._numbers, slow, self.noise2, np.zeros(ROOM))
        self._held = hold(self._work)
        self._slow = SlowMeans(slow[SLOW_READ], slow[SLOW_EXPECTED], slow[SLOW_SQUARES], slow[WEIGHT])
        nothing = np.zeros((6, channels))
        nothing[NEAR], nothing[RATES] = np.nan, np.nan
        self._nothing = StreamReadings(MeasuredRows.room(0, channels), nothing, self._slow, False)
        self._summarise = SameTypes(summarise)

    def take(self, rows: MeasuredRows | None, masked: NDArray[np.bool_], span: float) -> StreamReadings:
        """Take a block.

        Parameters
        ----------
        rows : MeasuredRows or None
            NaN of what is missing, or what the model does not have.
        masked : ndarray of bool, shape (channels,)
            Sensors that are not to be trusted.
        span : float
            Length (s) of the block that the slow means take; 0 if they are to leave it out.
        """
        if rows is None or not (count := len(rows.stamps)):
            return self._nothing
        if count > len(self._work.column):
            self._work = self._work._replace(column=np.zeros(2 * count))
            self._held = hold(self._work)
        stamps, raw, left = map(np.ascontiguousarray, rows)
        is_bent = self._summarise(self._held, stamps, raw, left, masked, min(1.0, span / WINDOW))
        return StreamReadings(rows, self._numbers.copy(), self._slow, bool(is_bent))


class PredictionMeans(NamedTuple):
    """What a block of predictions of n joints says.

    Attributes
    ----------
    strokes, variances : ndarray, shape (n,)
        Means of the strokes as measured, m, and of the variances of their estimates, m^2.
    rates : ndarray, shape (n,)
        Of the joints from the first prediction to the last, rad/s.
    largest : float
        Of the variances, m^2.
    shaking : float
        Mean square of the tip's acceleration, (m/s^2)^2.
    """

    strokes: Array
    variances: Array
    rates: Array
    largest: float
    shaking: float

    @classmethod
    def of(cls, rows: PredictionRows) -> PredictionMeans:
        """Of one prediction or more."""
        found = np.empty((3, rows.measured.shape[1]))
        given = rows.stamps, rows.measured, rows.variances, rows.joints, rows.accelerations
        largest, shaking = _summarise_predictions(*map(np.ascontiguousarray, given), found)
        return cls(found[MEASURED], found[SPREAD], found[TURNING], largest, shaking)
