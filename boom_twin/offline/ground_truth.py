"""Ground truth of a synthetic session: the true motion of the tip, as the virtual rig made it."""

from __future__ import annotations

import gzip
from collections import defaultdict
from dataclasses import dataclass
from io import BytesIO
from math import sqrt
from pathlib import Path

import numpy as np

from ..bag.reader import Session, read
from ..bag.session_file import WHOLE, TimeWindow
from ..errors import BagError
from ..messages.sample_decoder import stamp_of
from ..messages.topic_table import Topics
from ..system.files import holds_file, open_received
from ..twin.blocks import EstimateBlock, PredictionBlock
from ..types import NANO, Array
from .session_samples import topics_read

FILE_NAME = "truth.csv.gz"
LARGEST_TRUTH = 64 * 2**20  # bytes of an unpacked file that are read: about an hour at 200 Hz
COLUMNS = ("t_s", "tip_x_m", "tip_y_m", "tip_ax_m_s2", "tip_ay_m_s2")


@dataclass(frozen=True)
class TipTruth:
    """True motion of the tip at the stroke stamps of a session, m of them."""

    times: Array  # s after the start of the session; shape (m,)
    position: Array  # position, acceleration: m, m/s^2; x forward, y up; shape (m, 2)
    acceleration: Array

    def since(self, offset: float) -> TipTruth:
        """Return the truth from `offset` (s) after its beginning on."""
        kept = self.times >= self.times[0] + offset - 0.5 * NANO
        return TipTruth(self.times[kept], self.position[kept], self.acceleration[kept])

    def at(self, times: Array, values: Array) -> Array:
        """Return one of the truth's arrays at other times, shape (k, 2)."""
        return np.column_stack([np.interp(times, self.times, values[:, i]) for i in range(2)])


class TipErrors:
    """Root mean square errors of predictions and estimates, summed over parts of a session.

    The first prediction is at the first time of the truth. Predictions outside the times of the truth, as after a clock was
    set, do not count.
    """

    def __init__(self, truth: TipTruth) -> None:
        self._truth = truth
        self._first: int | None = None
        self._counts, self._squares = defaultdict[str, int](int), defaultdict[str, float](float)  # by names in ``summary.json``

    def add(self, predictions: PredictionBlock, estimates: EstimateBlock) -> None:
        """Add predictions, and the estimates at the same stamps."""
        if not len(predictions.stamps):
            return
        truth, self._first = self._truth, int(predictions.stamps[0]) if self._first is None else self._first
        times = (predictions.stamps - self._first) * NANO + truth.times[0]
        rows = (times >= truth.times[0]) & (times <= truth.times[-1])
        times = times[rows]
        position, acceleration = truth.at(times, truth.position), truth.at(times, truth.acceleration)
        fed = estimates.is_fed[rows]
        errors = {
            "tip_error_rms_m": predictions.tip_position[rows] - position,
            "tip_acceleration_error_rms_m_s2": predictions.tip_acceleration[rows] - acceleration,
            "tip_estimate_error_rms_m": (estimates.tip[rows, :2] - position)[fed],
            "tip_estimate_acceleration_error_rms_m_s2": (estimates.acceleration[rows, :2] - acceleration)[fed],
        }
        for name, error in errors.items():
            self._counts[name] += len(error)
            self._squares[name] += float(np.sum(error**2))

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square errors of position (m) and acceleration (m/s^2), by their names in ``summary.json``.

        Errors of estimates are included if there are any.
        """
        return {name: sqrt(self._squares[name] / count) for name, count in self._counts.items() if count}


def load_truth(folder: Path) -> TipTruth | None:
    """Return the truth beside a session, or None if there is none; `folder` is the session's own."""
    path = folder / FILE_NAME
    if not holds_file(path):
        return None
    try:
        with open_received(path) as packed, gzip.open(packed) as file:
            text = file.read(LARGEST_TRUTH + 1)
        if len(text) > LARGEST_TRUTH:
            raise ValueError(f"more than {LARGEST_TRUTH} bytes unpacked")
        header, _, rows = text.partition(b"\n")
        names = header.decode("ascii", "replace").strip().split(",")
        if lacking := [name for name in COLUMNS if name not in names]:
            raise ValueError(f"no column {lacking[0]}")
        places = list(map(names.index, COLUMNS))
        times, x, y, ax, ay = np.loadtxt(BytesIO(rows), delimiter=",", ndmin=2, unpack=True, usecols=places)
    except (OSError, ValueError, EOFError) as error:
        raise BagError(f"{path}: {error}. It needs columns {', '.join(COLUMNS)}; remove it to replay without.") from None
    return TipTruth(times, np.column_stack([x, y]), np.column_stack([ax, ay]))


def truth_in(window: TimeWindow, session: Session, topics: Topics) -> TipTruth | None:
    """Return the truth of a session from the first strokes in the window on."""
    truth = load_truth(session.path)
    if truth is None or window == WHOLE:
        return truth
    first, begin = (_first_stroke_stamp(session, topics, part) for part in (WHOLE, window))
    found = truth.since((begin - first) * NANO)
    return found if len(found.times) else None


def _first_stroke_stamp(session: Session, topics: Topics, window: TimeWindow) -> int:
    """Return the stamp of the first message of strokes in a window, ns; 0 if there is none."""
    messages, drive = read(session, topics_read(session, topics), window), topics.stroke_reading.stream
    return next((stamp_of(message) for name, _, message in messages if drive in topics.streams_by_topic[name]), 0)
