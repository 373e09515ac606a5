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

TOGETHER = 4096  # rows in memory
LONGEST_LINE = 2**16  # limit for the number of characters in a line

NOTHING = {"", "-", "nan", "null", "none", "na", "n/a", "#n/a"}  # texts of cells without a value, in lower case

_MARKS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
"""Encodings by the byte order mark at the start of a file."""


@dataclass(frozen=True, slots=True)
class CsvTable:
    """Cells of a CSV file below its header, or of some of its rows."""

    path: Path
    names: list[str]  # names of the columns, from the header
    rows: list[list[str]]  # the cells; empty lines are left out
    lines: list[int]  # line number of each row in the file, from 1
    error: type[BoomTwinError]  # type of the errors that are raised
    is_ended: bool = True  # False if the last row is the last of the file, and has no line end

    def column(self, name: str) -> list[float]:
        place = self.names.index(name)
        return [self._number(row, place, line) for row, line in zip(self.rows, self.lines, strict=True)]

    def require(self, names: Sequence[str]) -> None:
        """Raise `error` unless the header has all `names`."""
        if missing := [name for name in names if name not in self.names]:
            raise self.error(
                f"{self.path}: no column {', '.join(missing)} in its first line. It needs {','.join(names)}, "
                f"with commas between the columns and points in the numbers."
            )

    def _number(self, row: list[str], place: int, line: int) -> float:
        if place >= len(row):
            raise self.error(
                f"{self.path}, line {line}: {len(row)} of {len(self.names)} cells, {self.names[place]} is missing. "
                "If the file was cut off there, remove the line."
            )
        text = row[place].strip()
        try:
            return float(text)
        except ValueError:
            raise self.error(f"{self.path}, line {line}: {self.names[place]} = {text!r} is not a number.") from None


@dataclass(frozen=True, slots=True)
class CsvLayout:
    """How a file is written: encoding, separator, names of its columns, and the line of its first row, from 1."""

    encoding: str
    separator: str
    names: list[str]
    first_line: int


def read_csv(path: Path, error: type[BoomTwinError]) -> CsvTable:
    """Return the table in a file. Raise `error` if the file cannot be read or has no row below its header."""
    pieces = list(read_csv_pieces(path, error))
    rows, lines = [row for piece in pieces for row in piece.rows], [line for piece in pieces for line in piece.lines]
    return CsvTable(path, pieces[0].names, rows, lines, error)


def read_csv_pieces(path: Path, error: type[BoomTwinError], layout: CsvLayout | None = None) -> Iterator[CsvTable]:
    """Yield the table in a file, up to `TOGETHER` rows at a time, so that a file of any size takes little memory.

    Without a `layout` the names are in the first line, and columns are separated by commas. Raise `error` if the file cannot
    be read, a line is longer than `LONGEST_LINE`, or there is no row below the header.
    """
    try:
        encoding = layout.encoding if layout else marked_encoding(path) or "utf-8"
        with path.open(encoding=encoding, newline="") as file:
            lines = _Lines(file, is_strict=layout is None)
            reader = csv.reader(lines, delimiter=layout.separator if layout else ",", skipinitialspace=layout is not None)
            found = ((reader.line_num, row) for row in reader if row)
            if layout is None:
                _, header = next(found, (1, []))
                names = [name.strip() for name in header]
            else:
                names, first = layout.names, layout.first_line
                found = ((line, row) for line, row in found if line >= first)
            some = list(islice(found, TOGETHER))
            if names and not some:
                raise error(f"{path}: no rows below the header. Give at least one.")
            yield CsvTable(path, names, [row for _, row in some], [line for line, _ in some], error, lines.is_ended)
            while some := list(islice(found, TOGETHER)):
                yield CsvTable(path, names, [row for _, row in some], [line for line, _ in some], error, lines.is_ended)
    except UnicodeError as reason:
        raise error(f"{path}: its encoding cannot be read ({reason}). Save it as UTF-8.") from None
    except (OSError, csv.Error) as reason:
        raise error(f"{path}: {getattr(reason, 'strerror', None) or reason}. Give a CSV file.") from None


def marked_encoding(path: Path) -> str:
    """Return the encoding by the byte order mark of a file; empty without one."""
    with path.open("rb") as file:
        head = file.read(3)
    return next((encoding for mark, encoding in _MARKS.items() if head.startswith(mark)), "")


class _Lines:
    """Iterator of the lines of a file; counts them and checks their lengths. Unless `is_strict`, one with NULs is one NUL."""

    def __init__(self, file: TextIO, is_strict: bool) -> None:
        self._file, self._is_strict, self.number, self.is_ended = file, is_strict, 0, True

    def __iter__(self) -> Iterator[str]:
        while line := self._file.readline(LONGEST_LINE):
            self.number += 1
            self.is_ended = line.endswith(("\n", "\r"))
            if "\0" in line:
                if self._is_strict:
                    raise UnicodeError(f"a NUL in line {self.number}: UTF-16 or UTF-32 without a byte order mark?")
                line = "\0\n"
            if len(line) == LONGEST_LINE and not self.is_ended:
                raise csv.Error(f"line {self.number} is longer than {LONGEST_LINE} characters")
            yield line


def columns_text(columns: Mapping[str, Array]) -> str:
    """Return the text of a CSV file of `columns`, each of shape (rows,), with their names as its header."""
    text = StringIO(newline="")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.12g", delimiter=",", header=",".join(columns), comments="")
    return text.getvalue()
