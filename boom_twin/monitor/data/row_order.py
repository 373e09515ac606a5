"""Sort rows by their stamps, whatever stamps come."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...types import NANO
from .dropped_messages import MalformedError

BACK = 1_000_000_000
"""A stamp earlier by more than this (ns) may be that of a clock that was set back; by less it is out of order."""
AHEAD = 60_000_000_000
"""A stamp later by more than this (ns) may be a stray one; no table has its rows so far apart."""


@dataclass(frozen=True, slots=True)
class TableRow:
    """Row of a table: stamp (ns), names of the columns, values."""

    stamp: int
    columns: Sequence[str]
    values: Sequence[float]


@dataclass(frozen=True, slots=True)
class OrderedRows:
    """Outcome of one received row: the rows to store, and a stray row that is dropped.

    Attributes
    ----------
    rows : tuple of TableRow
        To be stored now, in this order.
    is_set_back : bool
        Whether time was set back, so that everything begins anew before that.
    stray : str
        Why a row that had been held back is dropped; empty if none is.
    """

    rows: tuple[TableRow, ...] = ()
    is_set_back: bool = False
    stray: str = ""


class RowOrder:
    """Filter that passes a row of a table if its stamp is after that of the row before.

    A row whose stamp leaps is held back until the next one of its table. If that goes on from it, time has leapt and both are
    let through; else it was a stray one.
    """

    def __init__(self) -> None:
        self._last: dict[str, int] = {}
        self._held: dict[str, TableRow] = {}

    def put(self, table: str, row: TableRow) -> OrderedRows:
        """Return the rows to store after `row`; raise MalformedError if its stamp is not after that of the row before."""
        last, held = self._last.get(table, row.stamp - 1), self._held.get(table)
        if not -BACK <= row.stamp - last <= AHEAD:
            return self._leap(table, row, last, held)
        if row.stamp <= last:
            raise MalformedError(f"its stamp is not after the last one but {(last - row.stamp) * NANO:.9g} s before it")
        self._last[table] = row.stamp
        self._held.pop(table, None)
        return OrderedRows((row,), stray=_stray(held, last))

    def _leap(self, table: str, row: TableRow, last: int, held: TableRow | None) -> OrderedRows:
        if held is None or not 0 < row.stamp - held.stamp <= AHEAD:
            self._held[table] = row
            return OrderedRows(stray=_stray(held, last))
        is_set_back = row.stamp < last
        if is_set_back:
            self._last.clear()
            self._held.clear()
        self._held.pop(table, None)
        self._last[table] = row.stamp
        return OrderedRows((held, row), is_set_back)


def _stray(held: TableRow | None, last: int) -> str:
    return "" if held is None else f"its stamp leaps by {(held.stamp - last) * NANO:.9g} s, and the next one's does not"
