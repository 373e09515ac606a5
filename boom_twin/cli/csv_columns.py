"""Read and write CSV files of numbers with named columns."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from io import StringIO
from pathlib import Path

import numpy as np

from ..errors import UsageError
from ..types import Array


def read_columns(path: Path, wanted: Sequence[str]) -> Array:
    """The columns `wanted` of a CSV file with a header, shape (rows, columns).

    Raises
    ------
    UsageError
        The file cannot be read, has another header, no rows, or a value that is not a number; says where.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [row for row in csv.reader(file) if row]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"{path}: {getattr(error, 'strerror', None) or error}. Give a CSV file.") from None
    header = [name.strip() for name in rows[0]] if rows else []
    missing = [name for name in wanted if name not in header]
    if missing:
        raise UsageError(f"{path}: no column {', '.join(missing)} in its first line. It needs {','.join(wanted)}.")
    if len(rows) < 2:
        raise UsageError(f"{path}: no rows below the header. Give at least one.")
    places = [header.index(name) for name in wanted]
    return np.array([[_number(path, line, row, header, place) for place in places] for line, row in enumerate(rows[1:], 2)])


def _number(path: Path, line: int, row: list[str], header: list[str], place: int) -> float:
    try:
        return float(row[place])
    except (ValueError, IndexError):
        value = row[place] if place < len(row) else ""
        raise UsageError(f"{path}, line {line}: {header[place]} = {value!r} is not a number.") from None


def columns_text(columns: Mapping[str, Array]) -> str:
    """A CSV file of `columns`, each (rows,), with their names as its header."""
    text = StringIO(newline="")
    np.savetxt(text, np.column_stack(list(columns.values())), fmt="%.12g", delimiter=",", header=",".join(columns), comments="")
    return text.getvalue()
