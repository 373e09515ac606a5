"""Tables of loggers: columns with names and units, from CSV and Parquet files or in memory."""

from __future__ import annotations

import csv
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from ..errors import BagError, UsageError
from ..system.files import open_received
from ..types import Array
from .csv_layout import BLANKS, THOUSANDS, CsvLayout, layout_of, split_header, unit_of

TOGETHER = 4096  # rows of a CSV file in memory
LONGEST_LINE = 2**16  # limit for the number of characters in a line
_GROUPING = re.compile(r"(?<=\d)[ '\u00a0\u202f](?=\d{3})")

Times = list[str] | NDArray[Any]  # cells of a column of times: texts, numbers in a unit, or `datetime64`


@dataclass
class LogRows:
    """Rows of a table: numbers and times by column index, and line numbers if the file is text."""

    numbers: dict[int, Array]
    times: dict[int, Times]
    lines: list[int] = field(default_factory=list)
    remark: str = ""
    skipped: list[int] = field(default_factory=list)  # numbers of lines between the data that are no data

    @property
    def skipped_text(self) -> str:
        """Count and first of the skipped lines in words, empty for none."""
        told = "lines left out, as they are comments, repeated headers or NULs"
        return f"{told}: {len(self.skipped)}, the first is line {self.skipped[0]}" if self.skipped else ""

    def place(self, row: int) -> str:
        """Return the line or row for a message."""
        return f"line {self.lines[row]}" if self.lines else f"row {row}"


class LogTable(ABC):
    """Table whose rows share a clock. `units` are given outside the headers, empty strings if there are none."""

    def __init__(self, source: str, headers: Sequence[str], units: Sequence[str], layout: str) -> None:
        self.source, self.headers, self.layout = source, list(headers), layout
        pairs = [split_header(header) for header in headers]
        self.names = [name for name, _ in pairs]
        self.units = [unit or unit_of(given) or given for (_, unit), given in zip(pairs, units, strict=True)]

    @abstractmethod
    def first(self, place: int) -> list[str]:
        """Return the first cells of a column as texts, without empty ones."""

    @abstractmethod
    def read(self, numbers: Sequence[int], times: Sequence[int]) -> LogRows:
        """Return all rows of some columns, NaN for an empty cell. Raise BagError for a cell that is no number."""


class _Piece(NamedTuple):
    """Some rows of a CSV file, with their line numbers, from 1."""

    rows: list[list[str]]
    lines: list[int]
    is_ended: bool  # False if the last row is the last of the file, and has no line end


class _Lines:
    """Iterator of the lines of a file, which checks their lengths. A line with NULs, as after a power cut, is one NUL."""

    def __init__(self, file: TextIO) -> None:
        self._file, self.is_ended = file, True

    def __iter__(self) -> Iterator[str]:
        number = 0
        while line := self._file.readline(LONGEST_LINE):
            number += 1
            self.is_ended = line.endswith(("\n", "\r"))
            line = "\0\n" if "\0" in line else line
            if len(line) == LONGEST_LINE and not self.is_ended:
                raise csv.Error(f"line {number} is longer than {LONGEST_LINE} characters")
            yield line


def _pieces(path: Path, layout: CsvLayout) -> Iterator[_Piece]:
    """Yield the rows below the header, up to `TOGETHER` at a time, so that a file of any size takes little memory."""
    try:
        with path.open(encoding=layout.encoding, newline="") as file:
            lines = _Lines(file)
            reader = csv.reader(lines, delimiter=layout.separator, skipinitialspace=True)
            found = ((reader.line_num, row) for row in reader if row and reader.line_num >= layout.first_line)
            while some := list(islice(found, TOGETHER)):
                yield _Piece([row for _, row in some], [line for line, _ in some], lines.is_ended)
    except UnicodeError as reason:
        raise BagError(f"{path}: its encoding cannot be read ({reason}). Save it as UTF-8.") from None
    except (OSError, csv.Error) as reason:
        raise BagError(f"{path}: {getattr(reason, 'strerror', None) or reason}. Give a CSV file.") from None


def _number_in(cell: str, is_comma: bool) -> float:
    """Return the number of a cell, NaN if blank. Raise ValueError for any other text or an ambiguous number."""
    text = _GROUPING.sub("", cell.strip())
    if text.lower() in BLANKS:
        return float("nan")
    if is_comma:
        if "." in text and "," not in text and THOUSANDS.fullmatch(text.replace(".", ",")):
            raise ValueError("a separator of thousands or a decimal mark")
        return float(text.replace(".", "").replace(",", ".") if "," in text else text)
    return float(text.replace(",", "") if THOUSANDS.fullmatch(text.partition(".")[0]) else text)


class CsvLogTable(LogTable):
    """Table of a CSV file, see `boom_twin.loggers.csv_layout.layout_of`."""

    def __init__(self, path: Path) -> None:
        self._path, self._layout = path, layout_of(path)
        super().__init__(str(path), self._layout.names, self._layout.units, self._layout.text)

    def first(self, place: int) -> list[str]:
        return [row[place] for row in self._layout.samples if place < len(row) and row[place]]

    def read(self, numbers: Sequence[int], times: Sequence[int]) -> LogRows:
        """See `LogTable`. A truncated last line, comments and repeated headers are left out."""
        parts: dict[int, list[Array]] = {place: [] for place in numbers}
        found = LogRows({}, {place: [] for place in times})
        for piece in _pieces(self._path, self._layout):
            rows, lines = self._usable(piece, found)
            found.lines += lines
            for place in numbers:
                parts[place].append(self._column(rows, lines, place))
            for place in times:
                found.times[place] += [row[place].strip() for row in rows]
        found.numbers = {place: np.concatenate(arrays) for place, arrays in parts.items()}
        return found

    def _usable(self, piece: _Piece, found: LogRows) -> tuple[list[list[str]], list[int]]:
        """Return rows padded with blanks to the length of the header, and their line numbers."""
        width, rows, lines = len(self._layout.names), list[list[str]](), list[int]()
        for row, line in zip(piece.rows, piece.lines, strict=True):
            cells = [cell.strip() for cell in row]
            if len(row) < width and not piece.is_ended and line == piece.lines[-1]:
                found.remark = f"line {line} was cut off ({len(row)} of {width} cells) and is left out"
                continue
            try:
                is_data = self._layout.is_data(cells)
            except ValueError as reason:
                raise BagError(f"{self.source}, line {line}: {reason}. Cut the file there; import takes both parts.") from None
            if not is_data:
                found.skipped += [line] * any(cells)
                continue
            if len(row) < width:
                row = [*row, *[""] * (width - len(row))]
            elif len(row) > width and any(cell.strip() for cell in row[width:]):
                told = f"{len(row)} cells, and the header has {width} names"
                raise BagError(f"{self.source}, line {line}: {told}. Export with ; or tab if the numbers have decimal commas.")
            rows.append(row)
            lines.append(line)
        return rows, lines

    def _column(self, rows: list[list[str]], lines: list[int], place: int) -> Array:
        is_comma, values = self._layout.is_comma, np.empty(len(rows))
        for number, row in enumerate(rows):
            try:
                values[number] = _number_in(row[place], is_comma)
            except ValueError as reason:
                told = "is a separator of thousands or a decimal mark" if "thousands" in str(reason) else "is not a number"
                raise BagError(
                    f"{self.source}, line {lines[number]}: {self.headers[place]} = {row[place].strip()!r} {told}. "
                    "Correct the cell, or empty it if there is no value."
                ) from None
        return values


def columns_of(table: CsvLogTable, names: Sequence[str]) -> Array:
    """Return the columns with these headers, shape (rows, columns). Raise BagError if one is missing or lacks a value."""
    if missing := [name for name in names if name not in table.headers]:
        there = ", ".join(header for header in table.headers if header)
        raise BagError(f"{table.source}: no column {', '.join(missing)}, but {there}. It needs {','.join(names)}.")
    found = table.read(places := [table.headers.index(name) for name in names], [])
    values = np.column_stack([found.numbers[place] for place in places])
    if found.remark:
        raise BagError(f"{table.source}: {found.remark} by an import. Remove the line.")
    for row, column in np.argwhere(np.isnan(values)):
        raise BagError(f"{table.source}, {found.place(row)}: {names[column]} has no value. Give one in every row.")
    return values


class ArrayTable(LogTable):
    """Table of arrays in memory, one for each column. A `datetime64` array holds times.

    Raise UsageError if a column is no array of numbers or times, or has another length than the others.
    """

    def __init__(self, source: str, columns: Mapping[str, Any]) -> None:
        self._columns = {name: _array(source, name, values) for name, values in columns.items()}
        lengths = {name: len(values) for name, values in self._columns.items()}
        if len({*lengths.values()}) > 1:
            told = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise UsageError(f"{source}: columns of different lengths ({told}). Give one value for each time, NaN without one.")
        super().__init__(source, list(columns), [""] * len(columns), "")

    def first(self, place: int) -> list[str]:
        values = [value for value in [*self._columns.values()][place][:200].tolist() if value == value]
        return [f"{value:.9g}" if isinstance(value, float) else str(value) for value in values]

    def read(self, numbers: Sequence[int], times: Sequence[int]) -> LogRows:
        arrays = [*self._columns.values()]
        return LogRows(
            {place: _numbers(self, place, arrays[place]) for place in numbers},
            {place: _times(arrays[place]) for place in times},
        )


def _array(source: str, name: str, values: Any) -> NDArray[Any]:
    array = np.ma.filled(values.astype(float), np.nan) if isinstance(values, np.ma.MaskedArray) else np.asarray(values)
    if array.ndim != 1:
        raise UsageError(f"{source}: {name} has shape {array.shape}. Give one number for each time: one column, one channel.")
    return array


def _numbers(table: ArrayTable, place: int, array: NDArray[Any]) -> Array:
    try:
        if array.dtype.kind not in "iufO":
            raise TypeError
        return array.astype(float)  # None becomes NaN
    except (TypeError, ValueError):
        told = f"{table.source}: {table.headers[place]} holds {array.dtype}, as {array[:1].tolist()}"
        raise UsageError(f"{told}. Give numbers, NaN where there is none.") from None


def _times(array: NDArray[Any]) -> Times:
    return array if array.dtype.kind in "Miuf" else [str(value) for value in array.tolist()]


def table_of_frame(frame: Any, source: str = "table") -> ArrayTable:
    """Return the table of a data frame (pandas, polars) or dict of arrays. A named index or time index is its first column."""
    columns: dict[str, Any] = {}
    if not (isinstance(frame, Mapping) or hasattr(frame, "columns")):
        raise UsageError(
            f"{source}: {type(frame).__name__} is no table. Give a path, a data frame, or a dict of arrays by name."
        )
    index = getattr(frame, "index", None)
    if index is not None and (getattr(index, "name", None) or getattr(index, "dtype", np.dtype(int)).kind == "M"):
        if getattr(index, "tz", None) is not None:
            index = index.tz_convert("UTC").tz_localize(None)
        columns[str(index.name or "time")] = index.to_numpy()
    for name in getattr(frame, "columns", frame):
        values = frame[name]
        if getattr(getattr(values, "dt", None), "tz", None) is not None:
            values = values.dt.tz_convert("UTC").dt.tz_localize(None)
        columns[str(name)] = values.to_numpy() if hasattr(values, "to_numpy") else values
    return ArrayTable(source, columns)


def table_of(path: Path) -> LogTable:
    """Return the table of a ``.parquet`` file, or of a CSV file with any other suffix.

    Raise BagError if the file cannot be read. Raise UsageError if pyarrow, which reads Parquet, is not installed.
    """
    try:
        open_received(path.resolve()).close()
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}). Check the path and its permissions.") from None
    if path.suffix.lower() != ".parquet":
        return CsvLogTable(path)
    try:
        from pyarrow import lib, parquet
    except ImportError:
        remedy = 'Run `pip install "boom_twin[import]"`.'
        raise UsageError(f"{path}: reading it needs pyarrow, which is not installed. {remedy}") from None
    try:
        table = parquet.read_table(path)
    except (lib.ArrowException, OSError, ValueError) as error:
        raise BagError(f"{path}: cannot be read ({type(error).__name__}: {error}). Export it as CSV.") from None
    columns = {name: column.to_numpy() for name, column in zip(table.column_names, table.columns, strict=True)}
    return table_of_frame(columns, str(path))
