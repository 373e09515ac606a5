"""Rows of the compiled update from which the report of one sample is made on request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..deviation.predictor import BoomPredictor
from ..types import Array, Estimate, Outline, Prediction, Residuals, Stream
from .blocks import STREAMS, estimate_of

NOTHING = np.zeros((0, 0))


class ReportRows:
    """Rows from which prediction, estimate and residuals of a report are made, see `boom_twin.types.Report.of_rows`.

    Parameters
    ----------
    boom : BoomPredictor
    channels : dict of Stream to tuple of str
        See `boom_twin.types.channels_of`.
    stamp : int
        ns, of the sample.

    Attributes
    ----------
    row, estimated, moments : ndarray or None
        Of the prediction, see `boom_twin.kernels.result_row`; of the estimate, see `boom_twin.deviation.estimate_row.WIDTH`;
        bending moments, N m. None where nothing was predicted.
    outline : Outline or None
        Of the prediction, if it has one.
    pins : int
        Pins with clearance.
    streams, stamps : sequence of int
        Of residuals; streams by `boom_twin.twin.blocks.CODES`.
    values, sigmas : ndarray, shape (k, w)
        Of residuals; NaN behind a stream's own channels.
    """

    __slots__ = (
        "_boom", "_channels", "estimated", "moments", "outline", "pins",
        "row", "sigmas", "stamp", "stamps", "streams", "values",
    )  # fmt: skip

    def __init__(self, boom: BoomPredictor, channels: Mapping[Stream, tuple[str, ...]], stamp: int) -> None:
        self._boom, self._channels, self.stamp, self.pins = boom, channels, stamp, boom.pins
        self.row: Array | None = None
        self.estimated: Array | None = None
        self.moments: Array | None = None
        self.outline: Outline | None = None
        self.streams: Sequence[int] = ()
        self.stamps: Sequence[int] = ()
        self.values = self.sigmas = NOTHING

    def prediction(self) -> Prediction | None:
        """Return the prediction, or None if there is none."""
        return None if self.row is None else self._boom.prediction_in(self.row, self.stamp, self.outline, self.moments)

    def estimate(self) -> Estimate | None:
        """Return the estimate, or None if there is none."""
        return None if self.estimated is None else estimate_of(self.stamp, self.estimated)

    def residuals(self) -> tuple[Residuals, ...]:
        """Return all residuals that became known by the sample."""
        found = []
        for row, code in enumerate(self.streams):
            names = self.names(code)
            values, sigmas = self.values[row, : len(names)], self.sigmas[row, : len(names)]
            found.append(Residuals(STREAMS[code], self.stamps[row], names, values, sigmas))
        return tuple(found)

    def names(self, code: int) -> tuple[str, ...]:
        """Return the names of a stream's channels."""
        return self._channels[STREAMS[code]]
