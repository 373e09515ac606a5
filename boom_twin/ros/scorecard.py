"""What a recorded live run shows, in numbers."""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import BagError
from ..io.intake import stamp_of
from ..io.reader import Session, read, scan
from ..io.topics import Output, Topic, load_topics
from ..records import Array, Stream

Truth = dict[int, Array]
"""True tip position (x, y) in m by the stamp of the stroke sample."""


@dataclass(frozen=True)
class Scorecard:
    """A live run.

    Attributes
    ----------
    predictions, residual_sets : int
        Messages that arrived.
    latency_ms : ndarray, shape (2,)
        Median and 99 % quantile from the arrival of a stroke to that of its prediction, both at the recorder.
    tip_error_rms : float or None
        Against the truth, m; None without one.
    residual_rms : dict of str to float
        Measured minus predicted by channel, in the unit of the sensor.
    """

    predictions: int
    residual_sets: int
    latency_ms: Array
    tip_error_rms: float | None
    residual_rms: dict[str, float]


def score(recorded: Path, truth: Truth | None) -> Scorecard:
    """The numbers of one recorded run.

    Raises
    ------
    BagError
        The recording cannot be read, or holds no prediction.
    """
    topics, session = load_topics(), scan(recorded)
    positions = _messages(session, topics.outputs[Output.TIP_POSITION])
    if not positions:
        raise BagError(f"{recorded}: the node published no prediction.")
    strokes = {stamp_of(msg): time for time, msg in _messages(session, topics.inputs[Stream.STROKES])}
    delays = [time - strokes[stamp_of(msg)] for time, msg in positions if stamp_of(msg) in strokes]
    residuals = _messages(session, topics.outputs[Output.RESIDUALS])
    return Scorecard(
        predictions=len(positions),
        residual_sets=len(residuals),
        latency_ms=np.quantile(delays, [0.5, 0.99]) * 1e-6 if delays else np.full(2, np.nan),
        tip_error_rms=None if truth is None else _tip_error([msg for _, msg in positions], truth),
        residual_rms=_residual_rms([msg for _, msg in residuals]),
    )


def read_truth(path: Path, session: Session) -> Truth:
    """The truth beside a synthetic session: a gzipped CSV with ``tip_x_m`` and ``tip_y_m``, one row per stroke sample.

    Raises
    ------
    BagError
        If its rows are not those of the session.
    """
    stamps = [stamp_of(msg) for _, msg in _messages(session, load_topics().inputs[Stream.STROKES])]
    with gzip.open(path, "rt", encoding="utf-8") as file:
        columns = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",", ndmin=2, usecols=[columns.index("tip_x_m"), columns.index("tip_y_m")])
    if len(rows) != len(stamps):
        raise BagError(f"{path}: {len(rows)} rows, but {session.path} has {len(stamps)} strokes. Write both anew.")
    return dict(zip(stamps, rows, strict=True))


def _messages(session: Session, topic: Topic) -> list[tuple[int, Any]]:
    """Log times and messages of one topic; none if it has none."""
    known = session.find(topic.absolute)
    if known is None or known.count == 0:
        return []
    return [(time, msg) for _, time, msg in read(session, {topic.absolute: topic.type})]


def _tip_error(positions: list[Any], truth: Truth) -> float:
    """Root mean square distance between predicted and true tip, m."""
    pairs = [(msg.point, truth[stamp_of(msg)]) for msg in positions if stamp_of(msg) in truth]
    squares = [(point.x - true[0]) ** 2 + (point.z - true[1]) ** 2 for point, true in pairs]
    return float(np.sqrt(np.mean(squares)))


def _residual_rms(residuals: list[Any]) -> dict[str, float]:
    """By channel, over the values that are there."""
    values: dict[str, list[NDArray[np.float64]]] = {}
    for msg in residuals:
        for name, value in zip(msg.name, msg.position, strict=True):
            values.setdefault(name, []).append(value)
    return {name: float(np.sqrt(np.nanmean(np.square(column)))) for name, column in sorted(values.items())}
