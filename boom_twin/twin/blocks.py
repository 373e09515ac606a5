"""Blocks of samples, and of what they caused: many of them at once, as arrays.

A block says the same as so many `Sample` or `Report`: the order of its rows is the order in which the samples were taken.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..types import Array, Health, Outline, Prediction, Report, Residuals, Sample, Stream, channels_of

Integers = NDArray[np.int64]

STREAMS = tuple(Stream)
"""A stream stands in a block as its place here."""
CODES = {stream: code for code, stream in enumerate(STREAMS)}
"""The place of every stream in `STREAMS`."""


class SampleBlock(NamedTuple):
    """Samples in the order in which they were taken.

    Attributes
    ----------
    streams : ndarray of int64, shape (k,)
        Of every sample, by `CODES`.
    stamps : ndarray of int64, shape (k,)
        Nanoseconds.
    values : ndarray, shape (k, w)
        See `Sample.values`; w is the largest number of channels of a stream, and behind a stream's own channels stands NaN.
    """

    streams: Integers
    stamps: Integers
    values: Array


class PredictionBlock(NamedTuple):
    """Predictions, one at every stroke sample that was followed; every field but the first and the last as in `Prediction`.

    Attributes
    ----------
    at : ndarray of int64, shape (p,)
        Row of the sample that caused it.
    stamps : ndarray of int64, shape (p,)
        Nanoseconds.
    tip_position, tip_displacement, tip_velocity, tip_acceleration : ndarray, shape (p, 2)
    tip_angle, tip_angular_velocity, tip_angular_acceleration : ndarray, shape (p,)
    joints, strokes, cylinder_forces : ndarray, shape (p, n)
    clearances : ndarray, shape (p, c, 4)
        Without such pins c is 0.
    moments : ndarray, shape (p, m)
    outlines : dict of int to Outline
        By row of this block, of those predictions that have one.
    """

    at: Integers
    stamps: Integers
    tip_position: Array
    tip_displacement: Array
    tip_velocity: Array
    tip_acceleration: Array
    tip_angle: Array
    tip_angular_velocity: Array
    tip_angular_acceleration: Array
    joints: Array
    strokes: Array
    cylinder_forces: Array
    clearances: Array
    moments: Array
    outlines: dict[int, Outline]

    def one(self, row: int) -> Prediction:
        """The prediction of a row; its arrays are views."""
        outline = self.outlines.get(row)
        return Prediction(
            stamp=int(self.stamps[row]),
            tip_position=self.tip_position[row],
            tip_displacement=self.tip_displacement[row],
            tip_velocity=self.tip_velocity[row],
            tip_acceleration=self.tip_acceleration[row],
            tip_angle=float(self.tip_angle[row]),
            tip_angular_velocity=float(self.tip_angular_velocity[row]),
            tip_angular_acceleration=float(self.tip_angular_acceleration[row]),
            joints=self.joints[row],
            strokes=self.strokes[row],
            cylinder_forces=self.cylinder_forces[row],
            shape=None if outline is None else outline.shape,
            undeflected=None if outline is None else outline.undeflected,
            pins=None if outline is None else outline.pins,
            clearances=self.clearances[row],
            moments=self.moments[row],
        )


class ResidualBlock(NamedTuple):
    """Residuals, in the order in which they became known; see `Residuals`.

    Attributes
    ----------
    at : ndarray of int64, shape (r,)
        Row of the sample by which it became known: its own, or the stroke sample that it waited for.
    streams, stamps : ndarray of int64, shape (r,)
        Stream by `CODES`; nanoseconds.
    values, sigmas : ndarray, shape (r, w)
        NaN behind a stream's own channels.
    """

    at: Integers
    streams: Integers
    stamps: Integers
    values: Array
    sigmas: Array


class ReportBlock(NamedTuple):
    """What samples caused of which nothing else is to be told: no event, no change, all accepted.

    In a bag stand, for each of its samples in turn, what `Report` of that sample has, in that order: with the stamp of the
    sample as log time its prediction, the residuals that became known, its health, the outline of its prediction.

    Attributes
    ----------
    stamps : ndarray of int64, shape (k,)
        Of all samples, nanoseconds.
    predictions : PredictionBlock
    residuals : ResidualBlock
    health : dict of int to Health
        By row of the sample.
    """

    stamps: Integers
    predictions: PredictionBlock
    residuals: ResidualBlock
    health: dict[int, Health]

    def reports(self, joints: int) -> list[Report]:
        """The same, a report for every sample, of a boom with so many joints."""
        channels = channels_of(joints)
        found: list[list[Residuals]] = [[] for _ in self.stamps]
        rows = zip(*(field.tolist() for field in self.residuals[:3]), self.residuals.values, self.residuals.sigmas, strict=True)
        for at, code, stamp, values, sigmas in rows:
            stream = STREAMS[code]
            names = channels[stream]
            found[at].append(Residuals(stream, stamp, names, values[: len(names)], sigmas[: len(names)]))
        predicted = {at: self.predictions.one(row) for row, at in enumerate(self.predictions.at.tolist())}
        return [
            Report(stamp, True, predicted.get(row), tuple(found[row]), health=self.health.get(row))
            for row, stamp in enumerate(self.stamps.tolist())
        ]


def block_of(samples: list[Sample], joints: int) -> SampleBlock:
    """Samples as a block, of a boom with so many joints."""
    width = max(len(names) for names in channels_of(joints).values())
    values = np.full((len(samples), width), np.nan)
    for row, sample in zip(values, samples, strict=True):
        row[: len(sample.values)] = sample.values
    streams = np.array([CODES[sample.stream] for sample in samples], np.int64)
    return SampleBlock(streams, np.array([sample.stamp for sample in samples], np.int64), values)


def samples_in(block: SampleBlock, joints: int) -> list[Sample]:
    """The samples of a block, of a boom with so many joints; their values are views."""
    counts = [len(names) for names in channels_of(joints).values()]
    rows = zip(block.streams.tolist(), block.stamps.tolist(), block.values, strict=True)
    return [Sample(STREAMS[code], stamp, values[: counts[code]]) for code, stamp, values in rows]
