"""Columns file: column and unit of each channel in a logger's files, and column of the time."""

from __future__ import annotations

from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ..config.yaml_text import read_plain
from ..errors import Fault, UsageError
from ..types import SENSORS, sensor_kind, stream_of
from .headers import TIME_UNITS, unit_of
from .log_table import LogTable
from .times import TimeColumn

_SEE = "`boom_twin import FILES --propose` prints a file to start from."
Text = Annotated[str, Field(min_length=1, max_length=500)]


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    file: Text = "*"

    def is_of(self, table: LogTable) -> bool:
        """Return True if the table's file name matches `file`."""
        return fnmatchcase(Path(table.source).name, self.file)


class ChannelColumn(_Entry):
    """Column of one channel: header with or without unit, in files that match the pattern `file`."""

    column: Text
    unit: Text | None = None


class TimeEntry(_Entry):
    """Column with the time, or two with date and time of day."""

    column: Text | list[Text]
    unit: str = ""
    order: Literal["", "dmy", "mdy", "ymd"] = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return (self.column,) if isinstance(self.column, str) else tuple(self.column)


class ColumnFile(BaseModel):
    """Content of a columns file. A channel set to ``none`` has no column."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    time: list[TimeEntry] = []
    timezone: str | None = None
    columns: dict[str, ChannelColumn | Literal["none"]] = {}

    def time_of(self, table: LogTable) -> TimeColumn:
        """Return the given time column of a table."""
        entry = next((entry for entry in self.time if entry.is_of(table)), None)
        return TimeColumn() if entry is None else TimeColumn(entry.names, unit_of(entry.unit), entry.order)


def load_columns(path: Path) -> ColumnFile:
    """Return the content of a columns file. UsageError lists all its faults."""
    return columns_from(read_plain(path, UsageError, _SEE), str(path))


def columns_from(document: Any, source: str) -> ColumnFile:
    """Return a columns file from its parsed values. UsageError lists all faults."""
    if isinstance(document, dict) and isinstance(document.get("time"), dict):
        document = {**document, "time": [document["time"]]}
    try:
        found = ColumnFile.model_validate(document or {})
    except ValidationError as error:
        faults = [
            Fault(".".join(map(str, each["loc"])), each["input"], each["msg"][:1].lower() + each["msg"][1:], _SEE)
            for each in error.errors(include_url=False)
        ]
    else:
        faults = [*_faults(found)]
    if faults:
        raise UsageError(
            "\n".join([f"{source}: {len(faults)} fault{'s' * (len(faults) > 1)}", *(f"  {fault}" for fault in faults)])
        )
    return found


def _faults(found: ColumnFile) -> list[Fault]:
    faults = []
    for number, entry in enumerate(found.time):
        if entry.unit and unit_of(entry.unit) not in TIME_UNITS:
            faults.append(
                Fault(f"time[{number}].unit", entry.unit, f"it must be one of {', '.join(TIME_UNITS)}", "Correct it.")
            )
    for channel, column in found.columns.items():
        if stream_of(channel) is None:
            known = ", ".join(kind.channels(1)[0] for kind in SENSORS.values())
            faults.append(Fault(f"columns.{channel}", channel, f"no channel; channels are {known} ..", "Name one of them."))
        elif column != "none" and column.unit is not None and unit_of(column.unit) not in sensor_kind(channel).units:
            units = ", ".join(sensor_kind(channel).units)
            remedy = "Give the column's unit. For any other, set scale in a mapping."
            faults.append(Fault(f"columns.{channel}.unit", column.unit, f"it must be one of {units}", remedy))
    return faults


def columns_of_options(given: ColumnFile, options: list[str], timezone: str | None) -> ColumnFile:
    """Return the columns file updated by ``--column CHANNEL=NAME[:UNIT]`` and ``--timezone``."""
    columns: dict[str, Any] = {channel: _plain(column) for channel, column in given.columns.items()}
    for option in options:
        channel, separator, name = option.partition("=")
        if not (separator and name):
            raise UsageError(f"--column {option}: give CHANNEL=NAME or CHANNEL=NAME:UNIT, as cylinder_1=Lift:mm.")
        begin, _, unit = name.rpartition(":")
        if name == "none":
            columns[channel] = name
        else:
            columns[channel] = {"column": begin, "unit": unit} if begin and unit_of(unit) else {"column": name}
    values = {"time": [_plain(entry) for entry in given.time], "timezone": timezone or given.timezone, "columns": columns}
    return columns_from(values, "--column")


def _plain(entry: Any) -> Any:
    return entry.model_dump(exclude_unset=True) if isinstance(entry, BaseModel) else entry
