"""What the page can show: tables of numbers by time, and the state of the lamps."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from operator import itemgetter

from .alarms import Alarms
from .dropped import MalformedError
from .lamps import Board
from .table import Table

NANO = 1e-9
MOST_BOARDS = 100_000
"""Earlier states of the lamps that are kept: a day of them."""


class Store:
    """All that a feed has told.

    Parameters
    ----------
    capacity : int
        Rows kept of every table.
    keeps_boards : bool
        Whether earlier states of the lamps are kept, as a replay needs them.

    Attributes
    ----------
    epoch : int
        Stamp (ns) that times count from: the first one.
    generation : int
        Raised when all is forgotten because time was set back.
    tables : dict of str to Table
        In order of their first row.
    alarms : Alarms
    """

    def __init__(self, capacity: int, keeps_boards: bool = False) -> None:
        self._capacity, self._keeps_boards = capacity, keeps_boards
        self.generation, self.epoch = 0, 0
        self.tables: dict[str, Table] = {}
        self.alarms = Alarms()
        self._boards: list[tuple[float, Board]] = []

    def clear(self) -> None:
        """Forget the numbers; the lamps stay as they are."""
        self.generation += 1
        self.epoch = 0
        self.tables = {}

    def time(self, stamp: int) -> float:
        """Seconds from the epoch, which the first stamp (ns) sets."""
        self.epoch = self.epoch or stamp
        return (stamp - self.epoch) * NANO

    def append(self, name: str, columns: Sequence[str], stamp: int, values: Sequence[float]) -> None:
        """Add a row to a table, made by its first one."""
        self.check(name, columns)
        table = self.tables.get(name)
        if table is None:
            table = self.tables[name] = Table(name, columns, self._capacity)
        table.append(self.time(stamp), values)

    def check(self, name: str, columns: Sequence[str]) -> None:
        """Raise MalformedError if a table has other columns than these."""
        table = self.tables.get(name)
        if table is not None and table.columns != tuple(columns):
            raise MalformedError(_difference(table.columns, columns))

    @property
    def newest(self) -> float:
        """Newest time of all tables, s; 0 without any."""
        return max((table.newest for table in self.tables.values()), default=0.0)

    def light(self, time: float, board: Board) -> None:
        """The lamps from `time` (s, as they count it) on."""
        if not self._keeps_boards:
            self._boards.clear()
        self._boards.append((time, board))
        if len(self._boards) > MOST_BOARDS:
            del self._boards[: MOST_BOARDS // 2]
        self.alarms.follow(self.newest, board)

    def board(self, time: float) -> Board:
        """The lamps as they were last told at `time` (s)."""
        place = bisect_right(self._boards, time, key=itemgetter(0)) if self._keeps_boards else len(self._boards)
        return self._boards[place - 1][1] if place else Board()


def _difference(first: Sequence[str], columns: Sequence[str]) -> str:
    odd = [name for name in (*columns, *first) if (name in columns) != (name in first)]
    told = f"{odd[0]} is only in one of them" if odd else "in another order"
    return f"{len(columns)} numbers, but {len(first)} at first ({told}); start the monitor again if the scene was changed"
