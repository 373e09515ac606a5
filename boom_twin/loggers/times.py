"""Conversion of logger times to stamps: numbers with unit, ISO stamps, local date and time in one or two columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta, tzinfo
from decimal import Decimal
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Annotated, Literal
from zoneinfo import ZoneInfo

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from ..errors import BagError, UsageError
from ..messages.sample_decoder import LATEST
from ..types import SECOND, Array
from .csv_layout import TIME_UNITS, is_time, unit_of
from .log_table import LogRows, LogTable, Times

Stamps = NDArray[np.int64]
Text = Annotated[str, Field(min_length=1, max_length=500)]
STEPS = 1e-4, 0.2  # s, usual range of the step between rows, used to infer the unit
LATE_1904, EXCEL_DAYS = 3.0e9, (3.0e4, 8.0e4)  # least s since 1904 (LabVIEW), range of days since 1899 (spreadsheets)
SINCE_1904, SINCE_1899 = 2_082_844_800 * SECOND, 25_569 * 86_400 * SECOND  # ns from 1904 and 1899 to 1970
MOST = LATEST + SINCE_1899  # ns; later times are stored as this
QUARTER = 900 * SECOND  # ns, offsets of time zones change only at multiples of it
_DATE = r"(?P<a>\d{1,4})(?P<mark>[-./ ])(?P<b>\d{1,2}|[A-Za-zÄä]{3,9}\.?)[-./ ](?P<c>\d{1,4})"
_MONTHS = ("jan", "feb", "mar mär mrz", "apr", "may mai", "jun", "jul", "aug", "sep", "oct okt", "nov", "dec dez")
"""Beginnings of the names of months, English and German."""
_PARTS = r"(?::(?P<s>\d{2})(?:[.,:](?P<part>\d+))?|[.,](?P<sub>\d+))?"  # behind h:min, or behind min:s
_CLOCK = rf"(?P<h>\d{{1,2}}):(?P<min>\d{{2}}){_PARTS}\s*(?P<half>[AaPp]\.?[Mm]\.?)?"
_MOMENT = re.compile(rf"(?:{_DATE})?[T ,;]*(?:{_CLOCK})?\s*(?P<zone>Z|UTC|[+-]\d{{2}}:?\d{{2}})?")


class Entry(BaseModel):
    """Entry of a columns file, for the files whose names match the pattern `file`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    file: Text = "*"

    def is_of(self, table: LogTable) -> bool:
        """Return True if the table's file name matches `file`."""
        return fnmatchcase(Path(table.source).name, self.file)


class TimeEntry(Entry):
    """Column with the time, or two with date and time of day; with unit of numbers, and order of dates."""

    column: Text | list[Text]
    unit: str = ""
    order: Literal["", "dmy", "mdy", "ymd"] = ""

    @property
    def names(self) -> tuple[str, ...]:
        return (self.column,) if isinstance(self.column, str) else tuple(self.column)


@dataclass(frozen=True, slots=True)
class TableTimes:
    """Stamps (ns) of the rows of a table, and how they were read.

    `is_absolute` is False for times since a start. `is_local` is True for local times without offset.
    """

    stamps: Stamps
    words: str
    is_absolute: bool
    is_local: bool = False


def zone_of(name: str) -> tzinfo:
    """Return a time zone by name. Raise UsageError if it is unknown."""
    try:
        return ZoneInfo(name)
    except (ValueError, OSError, KeyError):
        raise UsageError(
            f"timezone {name!r}: unknown. Give a name like Europe/Berlin; systems without zones need `pip install tzdata`."
        ) from None


def time_places(table: LogTable, given: TimeEntry | None) -> list[int]:
    """Return the indices of the time columns, given or recognised by name, empty if none."""
    if given is not None:
        places = [
            next((i for i, names in enumerate(zip(table.headers, table.names, strict=True)) if name in names), -1)
            for name in given.names
        ]
        if -1 not in places:
            return places
    filled = {place: table.first(place)[0] for place in range(len(table.names)) if table.first(place)}
    moments = {place: _kinds(first) for place, first in filled.items()}
    named = [place for place in filled if is_time(table.names[place]) or (not table.names[place] and "date" in moments[place])]
    both = [place for place in named if moments[place] == {"date", "clock"}]
    dates, clocks = ([place for place in named if moments[place] == {kind}] for kind in ("date", "clock"))
    numbers = [place for place in named if not moments[place]]
    pairs = [[dates[0], clocks[0]]] if len(dates) == len(clocks) == 1 else []
    choices = [*([place] for place in both), *pairs, *([place] for place in numbers), *([place] for place in clocks)]
    for places in choices:
        cells = [*zip(*map(table.first, places), strict=False)]
        if len({*cells}) > 0.9 * len(cells):
            return places
    return (choices or [[]])[0]


def read_times(
    table: LogTable, rows: LogRows, places: Sequence[int], given: TimeEntry | None, zone: tzinfo | None
) -> TableTimes:
    """Return the stamps of a table. Raise BagError for a cell that is no time and for an unknown unit."""
    header = " + ".join(table.headers[place] for place in places)
    cells = rows.times[places[0]]
    if isinstance(cells, np.ndarray) and cells.dtype.kind == "M":
        return TableTimes(cells.astype("datetime64[ns]").astype(np.int64), f"{header}: date and time, UTC", True)
    texts: list[str] = []
    if len(places) == 2:
        texts = [f"{day} {clock}" for day, clock in zip(rows.times[places[0]], rows.times[places[1]], strict=True)]
    elif isinstance(cells, list):
        texts = cells
    if texts and _kinds(next(filter(None, texts), "")):
        return _moments(table, rows, texts, header, given.order if given else "", zone)
    unit = (unit_of(given.unit) if given else "") or table.units[places[0]]
    return _numbers(table, rows, texts or cells, header, unit, zone)


def _kinds(text: str) -> set[str]:
    """Return which of ``date`` and ``clock`` a text has, empty for a number."""
    found = _MOMENT.fullmatch(text.strip())
    return {kind for kind, part in (("date", "a"), ("clock", "h")) if found and found[part] is not None}


def _numbers(table: LogTable, rows: LogRows, cells: Times, header: str, unit: str, zone: tzinfo | None) -> TableTimes:
    if unit and unit not in TIME_UNITS:
        raise BagError(
            f"{table.source}: {header} is in {unit}. Times are in {', '.join(TIME_UNITS)}: give unit in --columns FILE."
        )
    told = unit
    if not unit:
        values = _values(table, rows, cells, header)
        step = float(np.median(np.diff(values))) if len(values) > 1 else 0.01
        if step == 0.0:
            raise BagError(f"{table.source}: most rows have the {header} of the row before. Export it with more digits.")
        fitting = [
            u for u, size in TIME_UNITS.items() if u not in ("min", "h") and STEPS[0] <= step * size / SECOND <= STEPS[1]
        ]
        if "d" in fitting and not EXCEL_DAYS[0] < values[0] < EXCEL_DAYS[1]:
            fitting.remove("d")
        if len(fitting) != 1:
            known = f"may be in {' or '.join(fitting)}" if fitting else "have no unit that gives 5 to 10 000 rows a second"
            raise BagError(
                f"{table.source}: {header} grows by {step:g} from row to row; the times {known}. "
                "Give time: {column: .., unit: ..} in --columns FILE."
            )
        told = f"{fitting[0]} by their steps"
        unit = fitting[0]
    numbers = _integers(table, rows, cells, header, TIME_UNITS[unit])
    first = int(numbers[0])
    if unit == "d" and EXCEL_DAYS[0] * 86_400 < first / SECOND < EXCEL_DAYS[1] * 86_400:
        local = _to_utc(numbers - SINCE_1899, zone)
        return TableTimes(local, f"{header}: days of a spreadsheet", True, zone is None)
    if LATE_1904 * SECOND < first < (LATE_1904 + 2**31) * SECOND:
        numbers, told = numbers - SINCE_1904, f"{told} since 1904"
    if np.any(numbers >= LATEST):
        raise BagError(
            f"{table.source}: {header} goes beyond {LATEST / SECOND:.4g} s: not in {unit}. Give its unit in --columns FILE."
        )
    return TableTimes(numbers, f"{header}: {told}", first > 365 * 86_400 * SECOND)


def _values(table: LogTable, rows: LogRows, cells: Times, header: str) -> Array:
    """Return times as numbers in the unit of the column."""
    if isinstance(cells, np.ndarray):
        return cells.astype(np.float64)
    try:
        return np.array([float(text.replace(",", ".")) for text in cells])
    except ValueError:
        return _integers(table, rows, cells, header, SECOND).astype(np.float64)  # which names the row


def _integers(table: LogTable, rows: LogRows, cells: Times, header: str, size: int) -> Stamps:
    """Return times in a unit of `size` ns as integers, ns, those beyond `MOST` as one of these."""
    if isinstance(cells, np.ndarray):
        cells = np.minimum(cells, -(-MOST // size))
        if cells.dtype.kind in "iu":
            return cells.astype(np.int64) * size
        if not np.isfinite(cells).all():
            row = int(np.flatnonzero(~np.isfinite(cells))[0])
            raise BagError(f"{table.source}, {rows.place(row)}: {header} = {cells[row]} is no time. Leave the row out.")
        whole = np.floor(cells)
        found: Stamps = whole.astype(np.int64) * size + np.rint((cells - whole) * size).astype(np.int64)
        return found
    stamps = np.empty(len(cells), np.int64)
    for row, text in enumerate(cells):
        try:
            stamps[row] = min(int((Decimal(text.replace(",", ".")) * size).to_integral_value()), MOST)
        except (ArithmeticError, ValueError):
            raise BagError(
                f"{table.source}, {rows.place(row)}: {header} = {text!r} is not a time. Correct it, or leave the line out."
            ) from None
    return stamps


def _moments(table: LogTable, rows: LogRows, texts: list[str], header: str, order: str, zone: tzinfo | None) -> TableTimes:
    found = [_MOMENT.fullmatch(text.strip()) for text in texts]
    for row, match in enumerate(found):
        if match is None or match["h"] is None:
            raise BagError(
                f"{table.source}, {rows.place(row)}: {header} = {texts[row]!r} is not a date and time. "
                "Correct the cell, or leave the line out."
            )
    matches = [match for match in found if match is not None]
    has_date = matches[0]["a"] is not None
    order = order or (_order(table, matches, header) if has_date else "")
    naive, offsets = np.empty(len(matches), np.int64), np.zeros(len(matches), np.int64)
    for row, match in enumerate(matches):
        if (match["zone"] is None) != (matches[0]["zone"] is None):
            raise BagError(
                f"{table.source}, {rows.place(row)}: {header} = {texts[row]!r} and {texts[0]!r}: only one of them has an "
                "offset from UTC. Export all times with it, or none."
            )
        try:
            naive[row] = _day(match["a"], match["b"], match["c"], order) + _clock(match)
            offsets[row] = _offset(match["zone"])
        except (ValueError, TypeError):
            raise BagError(
                f"{table.source}, {rows.place(row)}: {header} = {texts[row]!r} is no date and time in the order "
                f"{order or 'h:min:s'}. Correct the cell, or give order: dmy, mdy or ymd under time in --columns FILE."
            ) from None
    if matches[0]["zone"]:
        return TableTimes(naive - offsets, f"{header}: date and time with offset", True)
    if not has_date:
        turn, told = (3600, "minutes and seconds") if matches[0]["sub"] else (86_400, "time of day without a date")
        turns = np.cumsum(np.r_[0, np.diff(naive) < -turn // 2 * SECOND])  # past midnight, or the full hour
        return TableTimes(naive + turns * turn * SECOND, f"{header}: {told}", False)
    return TableTimes(_to_utc(naive, zone), f"{header}: local date and time ({order})", True, zone is None)


def _order(table: LogTable, matches: list[re.Match[str]], header: str) -> str:
    """Return the order of day, month and year. Raise BagError if ambiguous."""
    if len(matches[0]["a"]) == 4:
        return "ymd"
    if matches[0]["mark"] == "." or matches[0]["b"][0].isalpha():
        return "dmy"
    if any(int(match["a"]) > 12 for match in matches):
        return "dmy"
    if any(int(match["b"]) > 12 for match in matches):
        return "mdy"
    told = f"{header} = {matches[0][0]!r} may be day/month or month/day"
    raise BagError(f"{table.source}: {told}. Give order: dmy or mdy under time in --columns FILE.")


@cache
def _day(a: str | None, b: str, c: str, order: str) -> int:
    """Return the ns from 1970 to the start of a date, 0 without a date."""
    if a is None:
        return 0
    if b[0].isalpha():
        b = str(next((number for number, names in enumerate(_MONTHS, 1) if b[:3].lower() in names.split()), 13))
    part = dict(zip(order, (int(a), int(b), int(c)), strict=True))
    year = part["y"] + 2000 * (part["y"] < 100)
    return (date(year, part["m"], part["d"]) - date(1970, 1, 1)).days * 86_400 * SECOND


def _clock(match: re.Match[str]) -> int:
    hour, part = int(match["h"]), (match["part"] or match["sub"] or "")[:9]
    if match["sub"]:  # mm:ss.f
        return (hour * 60 + int(match["min"])) * SECOND + int(part.ljust(9, "0"))
    if match["half"]:
        hour = hour % 12 + 12 * (match["half"][0] in "pP")
    if hour > 23:
        raise ValueError("hour")
    return (hour * 3600 + int(match["min"]) * 60 + int(match["s"] or 0)) * SECOND + int(part.ljust(9, "0"))


@cache
def _offset(zone: str | None) -> int:
    if zone is None or zone in ("Z", "UTC"):
        return 0
    return int(f"{zone[0]}1") * (int(zone[1:3]) * 3600 + int(zone[-2:]) * 60) * SECOND


def _to_utc(naive: Stamps, zone: tzinfo | None) -> Stamps:
    """Return local times as UTC. A step back in time marks the second run of a repeated hour."""
    if zone is None:
        return naive
    quarters, places = np.unique(naive // QUARTER, return_inverse=True)
    pairs = np.array([[_zone_offset(int(quarter), zone, fold) for fold in (0, 1)] for quarter in quarters])[places]
    again = np.cumsum(np.r_[False, np.diff(naive) < -1800 * SECOND]) > 0
    is_twice = pairs[:, 0] > pairs[:, 1]
    offsets: Stamps = np.where(is_twice & again, pairs[:, 1], pairs[:, 0])
    return naive - offsets


def _zone_offset(quarter: int, zone: tzinfo, fold: int) -> int:
    local = datetime(1970, 1, 1) + timedelta(seconds=quarter * QUARTER // SECOND)
    offset = local.replace(tzinfo=zone, fold=fold).utcoffset() or timedelta()
    return round(offset.total_seconds()) * SECOND
