"""Arrays for many samples at once: the samples, and the predictions, estimates and residuals that they caused.

The order of the rows is the order in which the samples were taken. Stamps are in ns.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..deviation import estimate_row as row_at
from ..predictions import Estimate, Outline, Prediction
from ..types import Array, Health, Report, Residuals, Sample, Stream, channels_of

Integers = NDArray[np.int64]

STREAMS = tuple(Stream)
"""Streams by code: a block holds the place of a stream in this tuple."""
CODES = {stream: code for code, stream in enumerate(STREAMS)}
"""Code of every stream: its place in `STREAMS`."""


class SampleBlock(NamedTuple):
    """Samples in the order in which they were taken."""

    streams: Integers  # (k,), by `CODES`
    stamps: Integers  # (k,)
    values: Array  # (k, w), see `Sample.values`; w is the largest number of channels of a stream, NaN behind a stream's own


class PredictionBlock(NamedTuple):
    """Predictions, one at every stroke sample that was followed; fields without comment as in `Prediction`, with p rows."""

    at: Integers  # (p,), row of the sample that caused it
    stamps: Integers  # (p,)
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
    outlines: dict[int, Outline]  # by row of this block, of those predictions that have one

    def one(self, row: int) -> Prediction:
        """Return the prediction of a row; its arrays are views."""
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


class _Columns:
    """Columns of the rows of an `EstimateBlock`, read as its attribute."""

    def __init__(self, first: int, count: int) -> None:
        self.place = slice(first, first + count)

    def __get__(self, block: EstimateBlock, owner: type) -> Array:
        return block.rows[:, self.place]


class EstimateBlock:
    """Estimates, one beside every prediction, in `rows` (p, WIDTH); see `boom_twin.deviation.estimate_row` and `Estimate`."""

    tip, velocity, acceleration = (_Columns(first, 3) for first in (row_at.TIP, row_at.VELOCITY, row_at.ACCELERATION))
    load = _Columns(row_at.FORCE, 2)
    modes, mode_rates = _Columns(row_at.COORDINATES, row_at.MODES), _Columns(row_at.RATES, row_at.MODES)
    tip_covariance, velocity_covariance = _Columns(row_at.TIP_COVARIANCE, 6), _Columns(row_at.VELOCITY_COVARIANCE, 6)
    acceleration_covariance, load_variance = _Columns(row_at.ACCELERATION_COVARIANCE, 6), _Columns(row_at.FORCE_VARIANCE, 2)

    def __init__(self, stamps: Integers, rows: Array) -> None:
        self.stamps, self.rows = stamps, rows

    @property
    def is_fed(self) -> NDArray[np.bool_]:
        """Return True for the rows after the first sensor reading, shape (p,).

        Until then the load is exactly zero and the estimate equals the prediction.
        """
        return np.asarray(self.load.any(axis=1))

    def one(self, row: int) -> Estimate:
        """Return the estimate of a row."""
        return estimate_of(int(self.stamps[row]), self.rows[row])


ESTIMATED = {name: columns.place for name, columns in vars(EstimateBlock).items() if isinstance(columns, _Columns)}
"""Fields of an `Estimate` in their order, and where each stands in a row, see `boom_twin.deviation.estimate_row`."""


def estimate_of(stamp: int, row: Array) -> Estimate:
    """Return the estimate at `stamp` (ns) in a row, see `boom_twin.deviation.estimate_row.WIDTH`; its arrays are views."""
    return Estimate(stamp, *(row[place] for place in ESTIMATED.values()))


def row_of(estimate: Estimate) -> Array:
    """Return the row of an estimate (inverse of `estimate_of`)."""
    return np.concatenate([getattr(estimate, name) for name in ESTIMATED])


class ResidualBlock(NamedTuple):
    """Residuals, in the order in which they became known; see `Residuals`."""

    at: Integers  # (r,), row of the sample by which it became known: its own, or the stroke sample that it waited for
    streams: Integers  # (r,), by `CODES`
    stamps: Integers  # (r,)
    values: Array  # (r, w), NaN behind a stream's own channels
    sigmas: Array  # (r, w)


class ReportBlock(NamedTuple):
    """Reports of accepted samples without events and changes, as arrays.

    A bag holds, for each sample in turn, what its `Report` holds, in this order: the prediction (log time: the sample's
    stamp), the residuals that became known, the health, the outline of the prediction.
    """

    stamps: Integers  # (k,), of all samples
    predictions: PredictionBlock
    estimates: EstimateBlock  # beside the predictions
    residuals: ResidualBlock
    health: dict[int, Health]  # by row of the sample

    def reports(self, joints: int) -> list[Report]:
        """Return one report for every sample, of a boom with so many joints."""
        channels = channels_of(joints)
        found: list[list[Residuals]] = [[] for _ in self.stamps]
        rows = zip(*(field.tolist() for field in self.residuals[:3]), self.residuals.values, self.residuals.sigmas, strict=True)
        for at, code, stamp, values, sigmas in rows:
            stream = STREAMS[code]
            names = channels[stream]
            found[at].append(Residuals(stream, stamp, names, values[: len(names)], sigmas[: len(names)]))
        places = self.predictions.at.tolist()
        predicted = {at: self.predictions.one(row) for row, at in enumerate(places)}
        estimated = {at: self.estimates.one(row) for row, at in enumerate(places)}
        return [
            Report(stamp, True, predicted.get(row), tuple(found[row]), health=self.health.get(row), estimate=estimated.get(row))
            for row, stamp in enumerate(self.stamps.tolist())
        ]


def block_of(samples: list[Sample], joints: int) -> SampleBlock:
    """Return samples as a block, of a boom with so many joints."""
    width = max(len(names) for names in channels_of(joints).values())
    values = np.full((len(samples), width), np.nan)
    for row, sample in zip(values, samples, strict=True):
        row[: len(sample.values)] = sample.values
    streams = np.array([CODES[sample.stream] for sample in samples], np.int64)
    return SampleBlock(streams, np.array([sample.stamp for sample in samples], np.int64), values)


def samples_in(block: SampleBlock, joints: int) -> list[Sample]:
    """Return the samples of a block, of a boom with so many joints; their values are views."""
    counts = [len(names) for names in channels_of(joints).values()]
    rows = zip(block.streams.tolist(), block.stamps.tolist(), block.values, strict=True)
    return [Sample(STREAMS[code], stamp, values[: counts[code]]) for code, stamp, values in rows]


def report_block(reports: list[Report], joints: int) -> ReportBlock:
    """Return reports as a block, of a boom with so many joints; events, changes and status are dropped."""
    found = [(at, each.prediction) for at, each in enumerate(reports) if each.prediction is not None]
    known = [(at, each) for at, report in enumerate(reports) for each in report.residuals]
    channels = channels_of(joints)
    width = max(len(names) for names in channels.values())
    values, sigmas = np.full((len(known), width), np.nan), np.full((len(known), width), np.nan)
    for row, (_, each) in enumerate(known):
        values[row, : len(each.values)], sigmas[row, : len(each.sigmas)] = each.values, each.sigmas

    def table(name: str, *columns: int) -> Array:
        rows = [getattr(each, name) for _, each in found]
        return np.array(rows, float).reshape(len(rows), *columns) if rows else np.zeros((0, *columns))

    pins = 0 if not found or found[0][1].clearances is None else len(found[0][1].clearances)
    moments = 0 if not found or found[0][1].moments is None else len(found[0][1].moments)
    predictions = PredictionBlock(
        at=np.array([at for at, _ in found], np.int64),
        stamps=np.array([each.stamp for _, each in found], np.int64),
        **{name: table(name, 2) for name in ("tip_position", "tip_displacement", "tip_velocity", "tip_acceleration")},
        **{name: table(name) for name in ("tip_angle", "tip_angular_velocity", "tip_angular_acceleration")},
        **{name: table(name, joints) for name in ("joints", "strokes", "cylinder_forces")},
        clearances=table("clearances", pins, 4) if pins else np.zeros((len(found), 0, 4)),
        moments=table("moments", moments) if moments else np.zeros((len(found), 0)),
        outlines={row: drawn for row, (_, each) in enumerate(found) if (drawn := _outline_of(each)) is not None},
    )
    residuals = ResidualBlock(
        at=np.array([at for at, _ in known], np.int64),
        streams=np.array([CODES[each.stream] for _, each in known], np.int64),
        stamps=np.array([each.stamp for _, each in known], np.int64),
        values=values,
        sigmas=sigmas,
    )
    health = {at: each.health for at, each in enumerate(reports) if each.health is not None}
    estimates = EstimateBlock(predictions.stamps, table_of([each.estimate for each in reports if each.prediction is not None]))
    return ReportBlock(np.array([each.stamp for each in reports], np.int64), predictions, estimates, residuals, health)


def table_of(estimates: list[Estimate | None]) -> Array:
    """Return rows of estimates, shape (k, WIDTH); NaN where there is none."""
    return np.array([np.full(row_at.WIDTH, np.nan) if each is None else row_of(each) for each in estimates]).reshape(
        -1, row_at.WIDTH
    )


def _outline_of(prediction: Prediction) -> Outline | None:
    if prediction.shape is None or prediction.undeflected is None or prediction.pins is None:
        return None
    return Outline(prediction.shape, prediction.undeflected, prediction.pins)


def joined(parts: list[ReportBlock]) -> ReportBlock:
    """Return one block that joins one or more blocks in order."""
    samples = np.cumsum([0, *(len(part.stamps) for part in parts)])[:-1].tolist()
    residuals_at = [part.residuals.at + first for part, first in zip(parts, samples, strict=True)]
    others = zip(*(part.residuals[1:] for part in parts), strict=True)
    return ReportBlock(
        np.concatenate([part.stamps for part in parts]),
        _joined_predictions([(part.predictions, first) for part, first in zip(parts, samples, strict=True)]),
        EstimateBlock(*(np.concatenate([getattr(part.estimates, each) for part in parts]) for each in ("stamps", "rows"))),
        ResidualBlock._make([np.concatenate(residuals_at), *map(np.concatenate, others)]),
        {first + row: health for part, first in zip(parts, samples, strict=True) for row, health in part.health.items()},
    )


def _joined_predictions(parts: list[tuple[PredictionBlock, int]]) -> PredictionBlock:
    """Return joined predictions; each block comes with the row of its first sample.

    Blocks without predictions have no column widths and are skipped.
    """
    parts = [part for part in parts if len(part[0].stamps)] or parts[:1]
    rows = np.cumsum([0, *(len(part.stamps) for part, _ in parts)])[:-1].tolist()
    fields = zip(*(part[1:-1] for part, _ in parts), strict=True)
    outlines = {
        first + row: outline for (part, _), first in zip(parts, rows, strict=True) for row, outline in part.outlines.items()
    }
    at = np.concatenate([part.at + first for part, first in parts])
    return PredictionBlock._make([at, *map(np.concatenate, fields), outlines])
