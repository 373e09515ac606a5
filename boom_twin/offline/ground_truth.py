"""Ground truth of a synthetic session: the true motion of the tip, as the virtual rig made it."""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import BagError
from ..system.received_files import holds_file, open_received
from ..twin.blocks import PredictionBlock
from ..types import NANO, Array

FILE_NAME = "truth.csv.gz"
LARGEST = 64 * 2**20
"""Bytes of an unpacked file that are read: about an hour at 200 Hz."""
COLUMNS = ("t_s", "tip_x_m", "tip_y_m", "tip_ax_m_s2", "tip_ay_m_s2")
LOAD_COLUMNS = ("tip_load_x_N", "tip_load_y_N")


@dataclass(frozen=True)
class TipTruth:
    """True motion of the tip at the stroke stamps of a session, m of them.

    Attributes
    ----------
    times : ndarray, shape (m,)
        s after the start of the session.
    position, acceleration : ndarray, shape (m, 2)
        m, m/s^2; x forward, y up.
    load : ndarray, shape (m, 2)
        External force at the tip, N; 0 where the file has none.
    """

    times: Array
    position: Array
    acceleration: Array
    load: Array

    def errors(self, predictions: PredictionBlock, rows: slice) -> dict[str, float]:
        """Root mean square of predicted minus true position (m) and acceleration (m/s^2), as vectors; rows of one clock."""
        stamps, first = predictions.stamps[rows], int(predictions.stamps[0])
        return {
            "tip_error_rms_m": self.position_error(stamps, first, predictions.tip_position[rows]),
            "tip_acceleration_error_rms_m_s2": self.acceleration_error(stamps, first, predictions.tip_acceleration[rows]),
        }

    def position_error(self, stamps: NDArray[np.int64], first: int, position: Array) -> float:
        """Root mean square of the distance to `position` (k, 2), m, told at `stamps` (ns); the truth begins at `first` (ns)."""
        return self._rms_off(stamps, first, position, self.position)

    def acceleration_error(self, stamps: NDArray[np.int64], first: int, acceleration: Array) -> float:
        """As `position_error`, of an acceleration (k, 2), m/s^2."""
        return self._rms_off(stamps, first, acceleration, self.acceleration)

    def _rms_off(self, stamps: NDArray[np.int64], first: int, told: Array, true: Array) -> float:
        times = (stamps - first) * NANO + self.times[0]
        return float(np.sqrt(np.mean(np.sum((told - self._at(times, true)) ** 2, axis=1))))

    def _at(self, times: Array, values: Array) -> Array:
        return np.column_stack([np.interp(times, self.times, values[:, i]) for i in range(2)])


def load_truth(folder: Path) -> TipTruth | None:
    """The truth beside a session, or None if there is none; `folder` is the session's own."""
    path = folder / FILE_NAME
    if not holds_file(path):
        return None
    try:
        with open_received(path) as packed, gzip.open(packed) as file:
            text = file.read(LARGEST + 1)
        if len(text) > LARGEST:
            raise ValueError(f"more than {LARGEST} bytes unpacked")
        table = np.genfromtxt(BytesIO(text), delimiter=",", names=True)
        values = {name: table[name] for name in COLUMNS}
        names = table.dtype.names or ()
        loads = [table[name] if name in names else np.zeros_like(values["t_s"]) for name in LOAD_COLUMNS]
    except (OSError, ValueError, EOFError) as error:
        raise BagError(f"{path}: {error}. It needs columns {', '.join(COLUMNS)}; remove it to replay without.") from None
    return TipTruth(
        values["t_s"],
        np.column_stack([values["tip_x_m"], values["tip_y_m"]]),
        np.column_stack([values["tip_ax_m_s2"], values["tip_ay_m_s2"]]),
        np.column_stack(loads),
    )
