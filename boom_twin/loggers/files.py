"""Readers of logger files: CSV, Parquet, TDMS and MDF."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BagError, UsageError
from ..system.received_files import open_received
from .log_table import ArrayTable, CsvLogTable, LogTable, table_of_frame

EXTRA = 'Run `pip install "boom_twin[import]"`.'


def tables_of(path: Path) -> list[LogTable]:
    """Return the tables of a file: one for each group of channels in TDMS and MDF, else one.

    Raises
    ------
    BagError
        The file cannot be read.
    UsageError
        The library that reads it is not installed.
    """
    try:
        open_received(path.resolve()).close()
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}). Check the path and its permissions.") from None
    reader = _READERS.get(path.suffix.lower())
    return [CsvLogTable(path)] if reader is None else reader(path)


def _parquet(path: Path) -> list[LogTable]:
    table = _read(path, "pyarrow.parquet", lambda library: library.read_table(path))
    columns = {name: column.to_numpy() for name, column in zip(table.column_names, table.columns, strict=True)}
    return [table_of_frame(columns, str(path))]


def _tdms(path: Path) -> list[LogTable]:
    """Return one table per group and length of channels. Waveforms without a column `time` get one."""
    groups = _read(path, "nptdms", lambda library: library.TdmsFile.read(path).groups())
    tables: list[LogTable] = []
    for group in groups:
        for length in dict.fromkeys(len(channel) for channel in group.channels()):
            channels = {channel.name: channel for channel in group.channels() if len(channel) == length}
            columns = {name: channel[:] for name, channel in channels.items()}
            wave = next(iter(channels.values())).properties
            if step := wave.get("wf_increment"):
                seconds = wave.get("wf_start_offset", 0.0) + step * np.arange(length)
                columns = {"time": _since(wave.get("wf_start_time"), seconds), **columns}
            units = {name: str(channel.properties.get("unit_string", "")) for name, channel in channels.items()}
            if length:
                tables.append(ArrayTable(str(path), columns, units | {"time": "s"}, f"TDMS, group {group.name}"))
    return tables


def _mdf(path: Path) -> list[LogTable]:
    """Return a table for every group of channels."""
    library = _read(path, "asammdf", lambda library: library.MDF(path))
    tables: list[LogTable] = []
    begin = library.header.start_time
    for number, group in enumerate(library.groups):
        master = library.masters_db.get(number)
        signals = [library.get(group=number, index=index) for index in range(len(group.channels)) if index != master]
        numeric = [
            signal for signal in signals if signal.samples.dtype.kind in "iufb" and signal.samples.ndim == 1 and len(signal)
        ]
        if numeric:
            columns = {"time": _since(begin, numeric[0].timestamps), **{signal.name: signal.samples for signal in numeric}}
            tables.append(
                ArrayTable(str(path), columns, {s.name: s.unit for s in numeric} | {"time": "s"}, f"MDF, group {number}")
            )
    library.close()
    return tables


def _since(begin: Any, seconds: Any) -> Any:
    """Return `begin` + `seconds`, or `seconds` if `begin` is None."""
    if begin is None:
        return seconds
    if getattr(begin, "tzinfo", None) is not None:
        begin = begin.astimezone(UTC).replace(tzinfo=None)
    return np.datetime64(begin, "ns") + np.rint(np.asarray(seconds) * 1e9).astype("timedelta64[ns]")


def _read(path: Path, module: str, read: Callable[[Any], Any]) -> Any:
    try:
        library = import_module(module)
    except ImportError:
        raise UsageError(f"{path}: reading it needs {module.partition('.')[0]}, which is not installed. {EXTRA}") from None
    try:
        return read(library)
    except Exception as error:  # libraries raise types of their own
        raise BagError(f"{path}: cannot be read ({type(error).__name__}: {error}). Export it as CSV.") from None


_READERS: dict[str, Callable[[Path], list[LogTable]]] = {
    ".parquet": _parquet, ".tdms": _tdms, ".mf4": _mdf, ".mdf": _mdf
}  # fmt: skip
