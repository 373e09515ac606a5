"""Columns of logger tables: the columns file, and the assignment to channels, given or recognised by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from ..config.yaml_text import read_plain
from ..errors import BagError, Fault, UsageError, bound_of, listed
from ..system.terminal_text import several
from ..types import SENSORS, Stream, channels_of, sensor_kind, stream_of
from .csv_layout import TIME_UNITS, guess, unit_of
from .log_table import LogTable
from .times import Entry, Text, TimeEntry, time_places

_SEE = "`boom_twin import FILES --propose` prints a file to start from."


class ChannelColumn(Entry):
    """Column of one channel: header with or without unit, in files that match the pattern `file`."""

    column: Text
    unit: Text | None = None


class ColumnFile(BaseModel):
    """Content of a columns file. A channel set to ``none`` has no column."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    time: list[TimeEntry] = []
    timezone: str | None = None
    columns: dict[str, ChannelColumn | Literal["none"]] = {}

    def time_of(self, table: LogTable) -> TimeEntry | None:
        return next((entry for entry in self.time if entry.is_of(table)), None)


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
            Fault(".".join(map(str, each["loc"])), each["input"], bound_of(each["msg"]), _SEE)
            for each in error.errors(include_url=False)
        ]
    else:
        faults = [*_faults(found)]
    if faults:
        raise UsageError(listed(source, faults))
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
    values = given.model_dump(exclude_unset=True)
    columns: dict[str, Any] = values.setdefault("columns", {})
    for option in options:
        channel, separator, name = option.partition("=")
        if not (separator and name):
            raise UsageError(f"--column {option}: give CHANNEL=NAME or CHANNEL=NAME:UNIT, as cylinder_1=Lift:mm.")
        begin, _, unit = name.rpartition(":")
        if name == "none":
            columns[channel] = name
        else:
            columns[channel] = {"column": begin, "unit": unit} if begin and unit_of(unit) else {"column": name}
    return columns_from({**values, "timezone": timezone or given.timezone}, "--column")


@dataclass(frozen=True, slots=True)
class ColumnUse:
    """Channel and unit of one column (index `place` of `table`), or the reason why it is unused."""

    table: int
    place: int
    channel: str = ""
    unit: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Assignment:
    """Used and unused columns, indices of the time columns by table, and problems that `check` raises."""

    tables: Sequence[LogTable]
    used: list[ColumnUse]
    unused: list[ColumnUse]
    times: list[list[int]]
    problems: list[str]

    @property
    def joints(self) -> int:
        """Highest cylinder or joint number, 1 if there is none."""
        ends = [use.channel.rpartition("_")[2] for use in self.used]
        return max((int(end) for end in ends if end.isdigit()), default=1)

    def header(self, use: ColumnUse) -> str:
        """Return the header of a column with its file."""
        return f"{self.tables[use.table].headers[use.place]!r} of {self.tables[use.table].source}"

    def check(self, joints: int, drive: Stream) -> None:
        """Raise BagError for a column without unit, a file without times or channels, and a missing column of `drive`."""
        problems, found = list(self.problems), {use.channel for use in self.used}
        for number, (table, times) in enumerate(zip(self.tables, self.times, strict=True)):
            if all(use.table != number for use in self.used):
                told = "; ".join(f"{self.header(use)}: {use.reason}" for use in self.unused if use.table == number)
                remedy = "Leave it out, or give --column CHANNEL=NAME:UNIT."
                problems.append(f"{table.source}: no column of a channel ({told}). {remedy}")
                continue
            if times and [table.names.count(table.names[place]) for place in times] != [1] * len(times):
                name = table.headers[times[0]]
                problems.append(
                    f"{table.source}: several columns {name!r}. Export each time column with its channels to its own file."
                )
            if not times:
                told = ", ".join(header for header in table.headers if header)
                problems.append(
                    f"{table.source}: no column of times among {told}. Give time: {{column: NAME, unit: s}} in --columns FILE."
                )
        driving = channels_of(joints)[drive]
        if (missing := [channel for channel in driving if channel not in found]) and self.used:
            free = "; ".join(f"{self.header(use)} ({use.reason})" for use in self.unused) or "none"
            needs = "the length of every cylinder; a mapping with `drive: angles` needs all angles instead"
            problems.append(
                f"no column for {', '.join(missing)}. Not used: {free}. Give --column {missing[0]}=NAME:UNIT or --columns "
                f"FILE; the twin needs {needs if drive is Stream.STROKES else 'the angle of every joint, by `drive: angles`'}."
            )
        if problems:
            raise BagError("\n  ".join([f"{several(len(problems), 'fault')} in the columns:", *problems]))


def assign(tables: Sequence[LogTable], given: ColumnFile, joints: int | None) -> Assignment:
    """Assign the columns of tables to channels.

    Columns that are not `given` are recognised by name. `joints` is the number of joints of the boom, if it is known. Raise
    BagError if a given column does not exist, or exists twice.
    """
    for entry in given.time:
        named = [table for table in tables if entry.is_of(table)]
        if not any({*entry.names} <= {*table.headers, *table.names} for table in named):
            there = ", ".join(repr(header) for table in named for header in table.headers if header)
            raise BagError(f"time: no column {' and '.join(map(repr, entry.names))} in a file {entry.file}. There are {there}.")
    found = Assignment(tables, [], [], [time_places(table, given.time_of(table)) for table in tables], [])
    taken = _given(found, given)
    for number, table in enumerate(tables):
        uses = [
            ColumnUse(number, place, *guess(table.names[place], table.units[place], joints))
            for place in range(len(table.headers))
            if table.headers[place] and place not in found.times[number] and (number, place) not in taken
        ]
        own = [use.channel for use in uses if use.channel and not _is_drive(table, use.place)]
        here = {use.channel for use in found.used if use.table == number}
        for use in uses:
            if not use.channel:
                found.unused.append(use)
            elif use.channel in given.columns or use.channel in here:
                found.unused.append(ColumnUse(number, use.place, reason=f"{use.channel} is given otherwise"))
            elif _is_drive(table, use.place):
                found.unused.append(ColumnUse(number, use.place, reason="a drive of `simulate`; its length is used"))
            elif own.count(use.channel) > 1:
                found.unused.append(ColumnUse(number, use.place, reason=f"one of several columns that may be {use.channel}"))
                header = table.headers[use.place]
                remedy = f"Give --column {use.channel}={header!r}, or in --columns FILE, columns: {{{use.channel}: none}}."
                told = f"{use.channel}: it may be {header!r} of {table.source}, or another. {remedy}"
                if table.headers.count(header) > 1:
                    told = f"{use.channel}: several columns {header!r} of {table.source}. Rename all but one in the file."
                found.problems.extend([told] * (told not in found.problems))
            else:
                _use(found, use)
    return found


def _is_drive(table: LogTable, place: int) -> bool:
    """Return True if a column is a drive with the cylinder's length beside it, as in a table of `simulate`."""
    stem, _, number = table.names[place].rpartition("_")
    return stem == "stroke" and f"length_{number}" in table.names


def _given(found: Assignment, given: ColumnFile) -> set[tuple[int, int]]:
    """Add the given columns to `found` and return their indices."""
    taken: set[tuple[int, int]] = set()
    for channel, column in given.columns.items():
        if not isinstance(column, ChannelColumn):
            continue
        places = [
            (number, place)
            for number, table in enumerate(found.tables)
            if column.is_of(table)
            for place, names in enumerate(zip(table.headers, table.names, strict=True))
            if column.column in (" ".join(names[0].split()), *names)
        ]
        if not places:
            names = [header for table in found.tables if column.is_of(table) for header in table.headers if header]
            near = get_close_matches(column.column, names, n=1, cutoff=0.4)
            remedy = (
                f"Did you mean {near[0]!r}?" if near else f"There are {', '.join(map(repr, names)) or 'no files of that name'}."
            )
            raise BagError(f"{channel}: no column {column.column!r}. {remedy}")
        if len({number for number, _ in places}) < len(places):
            raise BagError(f"{channel}: {found.tables[places[0][0]].source} has {column.column!r} twice. Rename one.")
        for number, place in places:
            unit = unit_of(column.unit or "") or found.tables[number].units[place]
            _use(found, ColumnUse(number, place, channel, unit))
            taken.add((number, place))
    return taken


def _use(found: Assignment, use: ColumnUse) -> None:
    units = sensor_kind(use.channel).units
    if use.unit not in units:
        told = f"unit {use.unit} is unknown there" if use.unit else "no unit is given"
        first = ", ".join(found.tables[use.table].first(use.place)[:3])
        name = found.tables[use.table].headers[use.place]
        found.problems.append(
            f"{use.channel}: {told} ({found.header(use)}, first {first}). "
            f"Write the unit behind the name, as {name + f' [{next(iter(units))}]'!r}, "
            f"or give --column {use.channel}={name!r}:UNIT, with one of {', '.join(units)}."
        )
    found.used.append(use)
