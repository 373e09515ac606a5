"""Numbers of a block of readings of one stream, worked out once for all that judge it: means, slow means, motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernels.jit import SameTypes, hold
from ..types import Array
from .blocks import MeasuredRows
from .sensor_survey import ReadingsWork, SlowMeans, summarise

WINDOW = 2.0  # s, time constant of the slow means
ENOUGH = 0.6  # weight of slow means that are judged: after 1.8 s


class StreamReadings(NamedTuple):
    """A block of k readings.

    Attributes
    ----------
    rows : MeasuredRows
    means : ndarray, shape (2, channels)
        Means of readings that the model has something to compare with, and of the expected ones; NaN of none.
    slow : SlowMeans
    is_bent : bool
        True if trusted sensors tell of a motion that is quick against their rate. Noise gives the same variance by second and
        by third differences, motion much less by third ones.
    """

    rows: MeasuredRows
    means: Array
    slow: SlowMeans
    is_bent: bool


class StreamSurvey:
    """Survey of the readings of one stream, block by block.

    Parameters
    ----------
    variance : float
        Variance of the noise of a reading, as stated.
    channels : int

    Attributes
    ----------
    slow : SlowMeans
    """

    def __init__(self, variance: float, channels: int) -> None:
        self.slow, unknown = SlowMeans(*np.zeros((5, channels))), np.full((2, channels), np.nan)
        self._work = ReadingsWork(variance, unknown.copy(), self.slow)
        self._held = hold(self._work)
        self._nothing = StreamReadings(MeasuredRows.room(0, channels), unknown, self.slow, False)
        self._summarise = SameTypes(summarise)

    def take(self, rows: MeasuredRows | None, masked: NDArray[np.bool_], span: float) -> StreamReadings:
        """Take a block.

        Parameters
        ----------
        rows : MeasuredRows or None
            NaN of what is missing, or what the model does not have.
        masked : ndarray of bool, shape (channels,)
            Sensors that are not to be trusted; their slow means begin anew.
        span : float
            Length (s) of the block that the slow means take; 0 if they are to leave it out.
        """
        if rows is None or not len(rows.stamps):
            return self._nothing
        columns = map(np.ascontiguousarray, rows)
        is_bent = self._summarise(self._held, *columns, masked, min(1.0, span / WINDOW))
        return StreamReadings(rows, self._work.means.copy(), self.slow, bool(is_bent))
