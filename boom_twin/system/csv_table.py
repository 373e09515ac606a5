"""Read and write tables of numbers as CSV files; errors name the line and the column."""

from __future__ import annotations

import codecs
import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from ..errors import BoomTwinError
from ..types import Array

LONGEST_LINE = 2**16
"""Limit for the number of characters in a line."""

NOTHING = {"", "-", "nan", "null", "none", "na", "n/a", "#n/a"}
"""Texts of cells without a value, in lower case."""

_MARKS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
"""Encodings by the byte order mark at the start of a file."""


@dataclass(frozen=True, slots=True)
class CsvTable:
    """Cells of a CSV file below its header, or of some of its rows."""

    path: Path
    names: list[str]
    """Names of the columns, from the header."""
    rows: list[list[str]]
    """The cells; empty lines are left out."""
    lines: list[int]
    """Line number of each row in the file, from 1."""
    error: type[BoomTwinError]
    """Type of the errors that are raised."""

    def column(self, name: str, blank: float | None = None) -> list[float]:
        """Return the numbers of a column, with `blank` for an empty cell. Without `blank`, an empty cell raises `error`."""
        place = self.names.index(name)
        return [self._number(row, place, line, blank) for row, line in zip(self.rows, self.lines, strict=True)]

    def require(self, names: Sequence[str]) -> None:
        """Raise `error` unless the header has all `names`."""
        if missing := [name for name in names if name not in self.names]:
            raise self.error(
                f"{self.path}: no column {', '.join(missing)} in its first line. It needs {','.join(names)}, "
                "with commas between the columns and points in the numbers."
            )

    def _number(self, row: list[str], place: int, line: int, blank: float | None) -> float:
        if place >= len(row):
            raise self.error(
                f"{self.path}, line {line}: {len(row)} of {len(self.names)} cells, {self.names[place]} is missing. "
                "If the file was cut off there, remove the line."
            )
        text = row[place].strip()
        if blank is not None and text.lower() in NOTHING:
            return blank
        try:
            return float(text)
        except ValueError:
            raise self.error(f"{self.path}, line {line}: {self.names[place]} = {text!r} is not a number.") from None


def read_csv(path: Path, error: type[BoomTwinError]) -> CsvTable:
    """Return the table in a file. Raise `error` if the file cannot be read or has no row below its header."""
    pieces = list(read_csv_pieces(path, error))
    rows, lines = [row for piece in pieces for row in piece.rows], [line for piece in pieces for line in piece.lines]
    return CsvTable(path, pieces[0].names, rows, lines, error)


def read_csv_pieces(path: Path, error: type[BoomTwinError], together: int = 4096) -> Iterator[CsvTable]:
    """Yield the table in a file, up to `together` rows at a time, so that a file of any size takes little memory.

    Raises
    ------
    BoomTwinError
        The type `error`: the file cannot be read, a line is longer than `LONGEST_LINE`, or there is no row below the header.
    """
    try:
        with path.open("rb") as file:
            head = file.read(3)
        encoding = next((encoding for mark, encoding in _MARKS.items() if head.startswith(mark)), "utf-8")
        with path.open(encoding=encoding, newline="") as file:
            reader = csv.reader(_lines(file))
            found = ((reader.line_num, row) for row in reader if row)
            _, header = next(found, (1, []))
            names, some = [name.strip() for name in header], list(islice(found, together))
            if header and not some:
                raise error(f"{path}: no rows below the header. Give at least one.")
            yield CsvTable(path, names, [row for _, row in some], [line for line, _ in some], error)
            while some := list(islice(found, together)):
                yield CsvTable(path, names, [row for _, row in some], [line for line, _ in some], error)
    except UnicodeError as reason:
        raise error(f"{path}: its encoding cannot be read ({reason}). Save it as UTF-8.") from None
    except (OSError, csv.Error) as reason:
        raise error(f"{path}: {getattr(reason, 'strerror', None) or reason}. Give a CSV file.") from None


def _lines(file: TextIO) -> Iterator[str]:
    number = 0
    while line := file.readline(LONGEST_LINE):
        number += 1
        if "\0" in line:
            raise UnicodeError(f"a NUL in line {number}: UTF-16 or UTF-32 without a byte order mark?")
        if len(line) == LONGEST_LINE and not line.endswith("\n"):
            raise csv.Error(f"line {number} is longer than {LONGEST_LINE} characters")
        yield line


def columns_text(columns: Mapping[str, Array]) -> str:
    """Return the text of a CSV file of `columns`, each of shape (rows,), with their names as its header."""
    text = StringIO(newline="")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.12g", delimiter=",", header=",".join(columns), comments="")
    return text.getvalue()
