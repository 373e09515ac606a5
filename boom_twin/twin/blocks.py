"""Arrays for many samples at once: samples, and the predictions, estimates and residuals that they cause.

The order of the rows is the order in which the samples were taken. Stamps are in ns.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..deviation import estimate_row as row_at
from ..predictions import Estimate, Outline, Prediction
from ..types import Array, Change, Health, Integers, Report, Residuals, Sample, Stream, StrokeReading, channels_of

Item = TypeVar("Item")

STREAMS = tuple(Stream)
"""Streams by code: a block holds the place of a stream in this tuple."""
CODES = {stream: code for code, stream in enumerate(STREAMS)}
"""Code of every stream: its place in `STREAMS`."""


class SampleBlock(NamedTuple):
    """Samples in the order in which they were taken."""

    streams: Integers  # (k,), by `CODES`
    stamps: Integers  # (k,)
    values: Array  # (k, w), see `Sample.values`; w is the largest number of channels of a stream, NaN behind a stream's own

    def part(self, rows: slice) -> SampleBlock:
        """Return some of the samples, as views."""
        return SampleBlock(self.streams[rows], self.stamps[rows], self.values[rows])


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
        drawn = {} if outline is None else {name: getattr(outline, name) for name in Outline.__slots__}
        numbers = {name: getattr(self, name)[row] for name in PREDICTED}
        return Prediction(int(self.stamps[row]), **numbers, **drawn)


PREDICTED = tuple(name for name in PredictionBlock._fields if name not in ("at", "stamps", "outlines"))
"""Fields of a `Prediction` that are columns of a `PredictionBlock`."""


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

    at: Integers  # (r,), row of the sample that made it computable: its own, or the later stroke sample that it waited for
    streams: Integers  # (r,), by `CODES`
    stamps: Integers  # (r,)
    values: Array  # (r, w), NaN behind a stream's own channels
    sigmas: Array  # (r, w)


class Note(NamedTuple):
    """Part of a sample's report beside the arrays; fields without comment as in `Report`."""

    accepted: bool = True
    events: tuple[str, ...] = ()
    status: str = "ok"
    change: Change | None = None


REGULAR = Note()


class ReportBlock(NamedTuple):
    """Reports of samples as arrays.

    A bag holds, for each sample in turn, what its `Report` holds, in this order: the prediction (log time: the sample's
    stamp), the residuals that became known, the change, the health, the outline of the prediction.
    """

    stamps: Integers  # (k,), of all samples
    predictions: PredictionBlock
    estimates: EstimateBlock  # beside the predictions
    residuals: ResidualBlock
    health: dict[int, Health]  # by row of the sample
    notes: dict[int, Note]  # by row of the sample, in their order; none of a regular sample

    def reports(self, joints: int) -> list[Report]:
        """Return one report for every sample of a boom with `joints` joints."""
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
            Report(
                stamp,
                (note := self.notes.get(row, REGULAR)).accepted,
                predicted.get(row),
                tuple(found[row]),
                note.events,
                note.status,
                note.change,
                self.health.get(row),
                estimated.get(row),
            )
            for row, stamp in enumerate(self.stamps.tolist())
        ]


def block_of(samples: list[Sample], joints: int) -> SampleBlock:
    """Return the block of samples of a boom with `joints` joints."""
    width = max(len(names) for names in channels_of(joints).values())
    values = np.full((len(samples), width), np.nan)
    for row, sample in zip(values, samples, strict=True):
        row[: len(sample.values)] = sample.values
    streams = np.array([CODES[sample.stream] for sample in samples], np.int64)
    return SampleBlock(streams, np.array([sample.stamp for sample in samples], np.int64), values)


def samples_in(block: SampleBlock, joints: int) -> list[Sample]:
    """Return the samples of a block of a boom with `joints` joints; their values are views."""
    counts = [len(names) for names in channels_of(joints).values()]
    rows = zip(block.streams.tolist(), block.stamps.tolist(), block.values, strict=True)
    return [Sample(STREAMS[code], stamp, values[: counts[code]]) for code, stamp, values in rows]


def joined(parts: list[ReportBlock]) -> ReportBlock:
    """Return one block that joins one or more blocks in order."""
    if len(parts) == 1:
        return parts[0]
    samples = np.cumsum([0, *(len(part.stamps) for part in parts)])[:-1].tolist()
    rows = np.cumsum([0, *(len(part.predictions.stamps) for part in parts)])[:-1].tolist()
    outlines = [(part.predictions.outlines, first) for part, first in zip(parts, rows, strict=True)]
    predictions = [part.predictions._replace(at=part.predictions.at + n) for part, n in zip(parts, samples, strict=True)]
    residuals = [part.residuals._replace(at=part.residuals.at + n) for part, n in zip(parts, samples, strict=True)]
    fields = map(np.concatenate, zip(*(part[:-1] for part in predictions), strict=True))
    return ReportBlock(
        np.concatenate([part.stamps for part in parts]),
        PredictionBlock._make([*fields, _moved(outlines)]),
        EstimateBlock(*(np.concatenate([getattr(part.estimates, each) for part in parts]) for each in ("stamps", "rows"))),
        ResidualBlock(*map(np.concatenate, zip(*residuals, strict=True))),
        _moved([(part.health, first) for part, first in zip(parts, samples, strict=True)]),
        _moved([(part.notes, first) for part, first in zip(parts, samples, strict=True)]),
    )


def _moved(parts: list[tuple[dict[int, Item], int]]) -> dict[int, Item]:
    return {first + row: item for found, first in parts for row, item in found.items()}


EVENTS = {
    "late": "stamp not after the newest one of its stream; sample left out",
    "duplicate": "stamp as the newest one of its stream, within 20 us; sample left out",
    "partial": "some values missing, not finite or absurd; the others were used",
    "empty": "no usable value; sample left out",
    "waiting": "no message with all strokes yet, or the model failed less than a second ago; it has not started",
    "gap": "longer pause between strokes, bridged",
    "restart": "pause too long to bridge, or strokes elsewhere after it; started again from rest",
    "stroke elsewhere": "a stroke jumped where its cylinder cannot go, and stayed there for a second; started from rest",
    "leap": "stamp far from its stream; left out, the next is used if it follows within `gap` (raise it for rates below 10 Hz)",
    "jump back": "time was set back; started again from rest",
    "second source": "samples of another source among those that are followed; left out",
    "implausible": "a stroke where its cylinder cannot be; left out, for up to a second if it jumped there",
    "out of range": "a stroke outside 0 to max_stroke of its cylinder; used where it is plausible",
    "held": "a stroke missing for long; predicted by the other sensors and by how its cylinder moved",
    "model": "the model failed; it starts again with the next full sample",
    "reset": "asked for; the model started again from rest",
    "load": "payload or line fill changed; the model started again from rest",
    "limits": "other settings changed while the twin ran",
    "zero": "the zero of a sensor was set anew",
    "deflected": "tip further than half the boom's reach from the undeformed boom's: outside the model's validity",
    "not used": "a stroke, though angles drive the model; left out",
    "unmatched": "no prediction at the stamp of this sample; no residual",
}

CONSEQUENCES = frozenset({"waiting", "model", "unmatched"})
"""Events that follow from others."""

TOLD_AT_ONCE = frozenset({"restart", "stroke elsewhere", "jump back", "reset", "load", "limits", "zero"})
"""Events whose report also has a `Change`."""


def event_meaning(name: str, reads: StrokeReading) -> str:
    """Return the meaning of an event where these readings drive the model; empty for an unknown event."""
    told = EVENTS.get(name, "")
    is_of_angles = reads is StrokeReading.ANGLE and name != "not used"
    return told.replace("strokes", "angles").replace("a stroke", "an angle") if is_of_angles else told
