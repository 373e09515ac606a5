"""Readers of logger files: CSV, Parquet, TDMS and MDF."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BagError, BoomTwinError, UsageError
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
    if reader is None:
        return [CsvLogTable(path)]
    try:
        return reader(path)
    except BoomTwinError:
        raise
    except Exception as error:  # libraries raise types of their own, also for one damaged group
        raise BagError(f"{path}: cannot be read ({type(error).__name__}: {error}). Export it as CSV.") from None


def _parquet(path: Path) -> list[LogTable]:
    table = _library(path, "pyarrow.parquet").read_table(path)
    columns = {name: column.to_numpy() for name, column in zip(table.column_names, table.columns, strict=True)}
    return [table_of_frame(columns, str(path))]


def _tdms(path: Path) -> list[LogTable]:
    """Return one table per group and length of channels. Waveforms without a column `time` get one."""
    tables: list[LogTable] = []
    for group in _library(path, "nptdms").TdmsFile.read(path).groups():
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
    tables: list[LogTable] = []
    with _library(path, "asammdf").MDF(path) as file:
        begin = file.header.start_time
        for number, group in enumerate(file.groups):
            master = file.masters_db.get(number)
            signals = [file.get(group=number, index=index) for index in range(len(group.channels)) if index != master]
            numeric = [each for each in signals if each.samples.dtype.kind in "iufb" and each.samples.ndim == 1 and len(each)]
            if numeric:
                columns = {"time": _since(begin, numeric[0].timestamps), **{each.name: each.samples for each in numeric}}
                units = {each.name: each.unit for each in numeric} | {"time": "s"}
                tables.append(ArrayTable(str(path), columns, units, f"MDF, group {number}"))
    return tables


def _since(begin: Any, seconds: Any) -> Any:
    """Return `begin` + `seconds`, or `seconds` if `begin` is None."""
    if begin is None:
        return seconds
    if getattr(begin, "tzinfo", None) is not None:
        begin = begin.astimezone(UTC).replace(tzinfo=None)
    return np.datetime64(begin, "ns") + np.rint(np.asarray(seconds) * 1e9).astype("timedelta64[ns]")


def _library(path: Path, module: str) -> Any:
    try:
        return import_module(module)
    except ImportError:
        raise UsageError(f"{path}: reading it needs {module.partition('.')[0]}, which is not installed. {EXTRA}") from None


_READERS: dict[str, Callable[[Path], list[LogTable]]] = {
    ".parquet": _parquet, ".tdms": _tdms, ".mf4": _mdf, ".mdf": _mdf
}  # fmt: skip
