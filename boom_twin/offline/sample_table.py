"""Table of a replay: one row per prediction, with readings, residuals and the estimate; CSV or Parquet.

A row has the newest value of every channel since the stamp of the previous row, up to its own stamp; empty without a value. So
a value stands once. A sensor with the stamps of the strokes has each value in the row of that stamp.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from itertools import chain
from pathlib import Path
from typing import IO, Any

import numpy as np

from ..deviation.estimate_row import MODES, VARIANCES
from ..errors import UsageError
from ..twin.blocks import CODES, SampleBlock
from ..types import NANO, SENSORS, USUAL_STREAMS, Array, Integers, Stream, channels_of
from .recording import Stretch

ESTIMATED = (
    "tip_x_m", "tip_y_m", "tip_angle_rad", "tip_vx_m_s", "tip_vy_m_s", "tip_angular_velocity_rad_s",
    "tip_ax_m_s2", "tip_ay_m_s2", "tip_angular_acceleration_rad_s2", "load_x_N", "load_y_N",
)  # fmt: skip
"""Names of the estimated quantities, with ``estimate_`` before them, or ``estimate_sigma_`` for their standard deviations."""
MODAL = [f"estimate_mode_{j}_{end}" for end in ("m", "m_s") for j in range(1, MODES + 1)]
"""Names of the modal coordinates and their rates, at a modal mass of 1 kg."""
NEVER = np.iinfo(np.int64).min


def predicted_columns(joints: int) -> list[str]:
    """Return the names of the columns of a prediction, as ``boom_twin simulate`` writes them, for so many joints."""
    numbers = range(1, joints + 1)
    return [
        "t_s",
        *(f"stroke_{i}_m" for i in numbers),
        *(f"joint_{i}_rad" for i in numbers),
        *("tip_x_m", "tip_y_m", "tip_ax_m_s2", "tip_ay_m_s2"),
        *(f"cylinder_force_{i}_N" for i in numbers),
    ]


def columns_of(joints: int, streams: Collection[Stream] = USUAL_STREAMS) -> list[str]:
    """Return the names of all columns: predicted, measured, residuals, modes, estimated, deviations of the estimate."""
    return [
        *predicted_columns(joints),
        *chain.from_iterable(_channel_columns(joints, streams, "measured").values()),
        *chain.from_iterable(_channel_columns(joints, streams, "residual").values()),
        *MODAL,
        *(f"estimate_{name}" for name in ESTIMATED),
        *(f"estimate_sigma_{name}" for name in ESTIMATED),
    ]


def _channel_columns(joints: int, streams: Collection[Stream], kind: str) -> dict[Stream, list[str]]:
    return {
        stream: [f"{kind}_{name}_{SENSORS[stream].unit_suffix}" for name in names]
        for stream, names in channels_of(joints, streams).items()
    }


class CsvFile:
    """CSV file with a header; numbers with nine significant digits, times with nine decimals, empty for NaN."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self._file: IO[str] = path.open("w", encoding="ascii", newline="\n")
        self._file.write(",".join(columns) + "\n")
        self._form = ",".join(["%.9f", *["%.9g"] * (len(columns) - 1)]) + "\n"

    def write(self, rows: Array) -> None:
        """Append rows, shape (k, columns)."""
        self._file.write("".join(self._form % tuple(row) for row in rows.tolist()).replace("nan", ""))

    def close(self) -> None:
        self._file.close()


class ParquetFile:
    """Parquet file with one row group for every stretch; doubles, null for NaN."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self._arrow, parquet = _arrow()
        self._schema = self._arrow.schema([(name, self._arrow.float64()) for name in columns])
        self._writer = parquet.ParquetWriter(path, self._schema)

    def write(self, rows: Array) -> None:
        arrays = [self._arrow.array(np.ascontiguousarray(column), from_pandas=True) for column in rows.T]
        self._writer.write_table(self._arrow.Table.from_arrays(arrays, schema=self._schema))

    def close(self) -> None:
        self._writer.close()


def _arrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet

        return pyarrow, parquet
    except ImportError as error:
        raise UsageError(f"--table parquet needs pyarrow ({error}): pip install pyarrow, or take --table csv.") from None


def check_kind(kind: str | None) -> None:
    """Raise UsageError if tables of that kind cannot be written here; to be called before a long run."""
    if kind == "parquet":
        _arrow()


def table_file(path: Path, columns: Sequence[str]) -> CsvFile | ParquetFile:
    """Return the file of a table with these columns, by the end of its name ``.csv`` or ``.parquet``.

    Raise UsageError if a package that is needed is not there.
    """
    return CsvFile(path, columns) if path.suffix == ".csv" else ParquetFile(path, columns)


class SampleTable:
    """Builder of a replay's table with the columns of `columns_of`. `put` receives rows, shape (k, columns).

    `boom_twin.offline.replay.replay_into` passes stretches to `add`.
    """

    def __init__(self, put: Callable[[Array], object], joints: int, streams: Collection[Stream] = USUAL_STREAMS) -> None:
        columns = columns_of(joints, streams)
        self._put = put
        self._measured, self._residuals = (
            {CODES[stream]: columns.index(names[0]) for stream, names in found.items() if names}
            for found in (_channel_columns(joints, streams, kind) for kind in ("measured", "residual"))
        )
        self._widths = {CODES[stream]: len(names) for stream, names in channels_of(joints, streams).items()}
        self._stamps: Integers = np.zeros(0, np.int64)  # of the rows that wait, ascending
        self._rows: Array = np.zeros((0, len(columns)))
        self._before = NEVER  # stamp of the row before them
        self._ahead: list[SampleBlock] = []  # samples that may be of rows to come

    def add(self, stretch: Stretch) -> None:
        """Add the next stretch; rows restart where a clock was set back over earlier stamps."""
        delay = 2.0  # time (s) that a row waits for late residuals
        stamps, rows, residuals = stretch.predictions.stamps, self._new_rows(stretch), stretch.block.residuals
        for part in np.split(np.arange(len(stamps)), np.flatnonzero(np.diff(stamps) <= 0) + 1):
            if len(self._stamps) and stamps[part[0]] <= self._stamps[-1]:
                self._write_first(len(self._stamps))
                self._before = NEVER
            self._stamps = np.concatenate([self._stamps, stamps[part]])
            self._rows = np.concatenate([self._rows, rows[part]])
            for block in [*self._ahead, *stretch.samples]:
                self._fill(self._measured, block.streams, block.stamps, block.values)
            self._fill(self._residuals, residuals.streams, residuals.stamps, residuals.values)
        self._ahead = stretch.samples[-2:]  # the rows of a block may come in two stretches
        self._write_first(int(np.searchsorted(self._stamps, self._stamps[-1] - round(delay / NANO))))

    def finish(self) -> None:
        self._write_first(len(self._stamps))

    def _new_rows(self, stretch: Stretch) -> Array:
        """Return rows with the predicted and estimated values; the rest is NaN."""
        p, e = stretch.predictions, stretch.estimates
        rows = np.full((len(p.stamps), self._rows.shape[1]), np.nan)
        seconds = (p.stamps - stretch.first) * NANO
        predicted = np.column_stack([seconds, p.strokes, p.joints, p.tip_position, p.tip_acceleration, p.cylinder_forces])
        covariances = e.tip_covariance, e.velocity_covariance, e.acceleration_covariance
        variances = *(each[:, VARIANCES] for each in covariances), e.load_variance
        told = e.modes, e.mode_rates, e.tip, e.velocity, e.acceleration, e.load
        estimated = np.column_stack([*told, *map(np.sqrt, variances)])
        rows[:, : predicted.shape[1]], rows[:, -estimated.shape[1] :] = predicted, estimated
        return rows

    def _fill(self, places: dict[int, int], streams: Integers, stamps: Integers, values: Array) -> None:
        """Write values (k, w) of channels at `stamps` (ns) into their rows; `places` by stream: first column."""
        order = np.argsort(stamps, kind="stable")
        row = np.searchsorted(self._stamps, stamps[order])
        inside = (row < len(self._stamps)) & (stamps[order] > self._before)
        order, row = order[inside], row[inside]
        for code, first in places.items():
            own = streams[order] == code
            for channel in range(self._widths[code]):
                column = values[order[own], channel]
                known = np.isfinite(column)
                self._rows[row[own][known], first + channel] = column[known]

    def _write_first(self, count: int) -> None:
        if count:
            self._put(self._rows[:count])
            self._before = int(self._stamps[count - 1])
            self._stamps, self._rows = self._stamps[count:], self._rows[count:]
