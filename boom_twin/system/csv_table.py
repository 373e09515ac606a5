"""Read and write tables of numbers as CSV files; errors name the line and the column."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np

from ..errors import BoomTwinError
from ..types import Array


@dataclass(frozen=True, slots=True)
class CsvTable:
    """The cells of a CSV file below its header.

    Attributes
    ----------
    path : Path
    names : list of str
        Of the columns, from the header.
    rows : list of list of str
        The cells; empty lines are left out.
    lines : list of int
        Line of each row in the file, from 1.
    error : type
        Of what is raised.
    """

    path: Path
    names: list[str]
    rows: list[list[str]]
    lines: list[int]
    error: type[BoomTwinError]

    def column(self, name: str, blank: float | None = None) -> list[float]:
        """The numbers of a column; `blank` for an empty cell, which without it is an error."""
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
        if not text and blank is not None:
            return blank
        try:
            return float(text)
        except ValueError:
            raise self.error(f"{self.path}, line {line}: {self.names[place]} = {text!r} is not a number.") from None


def read_csv(path: Path, error: type[BoomTwinError]) -> CsvTable:
    """The table in a file; `error` if the file cannot be read or has no row below its header."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            found = [(reader.line_num, row) for row in reader if row]
    except (OSError, UnicodeDecodeError, csv.Error) as reason:
        raise error(f"{path}: {getattr(reason, 'strerror', None) or reason}. Give a CSV file.") from None
    (_, header), *rows = found or [(1, [])]
    table = CsvTable(path, [name.strip() for name in header], [row for _, row in rows], [line for line, _ in rows], error)
    if header and not rows:
        raise error(f"{path}: no rows below the header. Give at least one.")
    return table


def columns_text(columns: Mapping[str, Array]) -> str:
    """A CSV file of `columns`, each (rows,), with their names as its header."""
    text = StringIO(newline="")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.12g", delimiter=",", header=",".join(columns), comments="")
    return text.getvalue()
