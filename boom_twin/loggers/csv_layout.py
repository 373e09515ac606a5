"""Detection of a CSV file's layout: encoding, separator, preamble, header, units, decimal mark."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from ..errors import BagError
from ..system.csv_table import NOTHING, CsvLayout, marked_encoding
from .headers import guess, is_time, split_header, unit_of

HEAD = 2**18  # bytes read to detect the layout
SEPARATORS = {"\t": "tab", ";": ";", ",": ",", "|": "|"}
"""Names of separators in order of trial: first tab and ; (never decimal marks)."""
BLANKS = NOTHING | {"--", "---", "-nan", "1.#qnan", "-1.#ind", "#nv", "#wert!", "#div/0!", "#num!", "#value!", "inf", "-inf"}
"""Texts of cells without a value, in lower case."""
NUMERIC_SHARE = 0.6  # least share of numbers and times among the filled cells of a numeric column
_NUMBER = re.compile(r"[+-]?(\d[\d'. ]*([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?", re.IGNORECASE)
_MOMENT = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}.*|.*\d{1,2}:\d{2}.*")
_GROUPING = re.compile(r"(?<=\d)[ '\u00a0\u202f](?=\d{3})")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")


@dataclass(frozen=True, slots=True)
class LoggerLayout(CsvLayout):
    """Layout of a logger's file, with the units of its columns and its first rows."""

    units: list[str]
    """Units from the row of units, or empty strings. Known units have this package's spelling."""
    is_comma: bool  # True if the decimal mark is a comma
    samples: list[list[str]]  # first rows of data
    header_line: int

    @property
    def text(self) -> str:
        """Layout in words."""
        mark = "decimal comma" if self.is_comma else "decimal point"
        return f"{self.encoding}, separator {SEPARATORS[self.separator]}, {mark}, header in line {self.header_line}"


def layout_of(path: Path) -> LoggerLayout:
    """Return the layout of a file. Raise BagError if there is no table of numbers with a header in it."""
    try:
        encoding = _encoding(path)
        with path.open("rb") as file:
            data = file.read(HEAD)
            is_whole = not file.read(1)
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}). Check the path and its permissions.") from None
    text = codecs.getincrementaldecoder(encoding)("replace").decode(data).removeprefix("\ufeff")
    if not is_whole:
        text = text[: text.rfind("\n") + 1]
    for separator in SEPARATORS:
        if (found := _table(path, text, separator, encoding)) is not None:
            return found
    first = next((line for line in text.splitlines() if line.strip()), "")[:60]
    raise BagError(
        f"{path}: no table found. The file begins with {first!r}. It needs a line with the names of the columns, "
        "then rows of numbers, with tab, ; , or | between them."
    )


def _encoding(path: Path) -> str:
    """Return the encoding by the byte order mark, else by the bytes."""
    if marked := marked_encoding(path):
        return marked
    decoder = codecs.getincrementaldecoder("utf-8")()
    with path.open("rb") as file:
        head = file.read(HEAD)
        if head.count(0) > len(head) // 4:
            return "utf-16-le" if head[1::2].count(0) > head[::2].count(0) else "utf-16-be"
        try:
            block = head
            while block:
                decoder.decode(block)
                block = file.read(2**20)
            decoder.decode(b"", True)
        except UnicodeDecodeError:
            return "cp1252"
    return "utf-8"


def _table(path: Path, text: str, separator: str, encoding: str) -> LoggerLayout | None:
    """Return the layout if `text` is a table with this separator, else None."""
    try:
        reader = csv.reader(StringIO(text, newline=""), delimiter=separator, skipinitialspace=True)
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error:
        return None
    tail = [row for _, row in rows[len(rows) // 2 :]]
    width, count = Counter(map(len, tail)).most_common(1)[0] if tail else (0, 0)
    if width < 2 or count < 0.5 * len(tail):
        return None
    numeric = [place for place in range(width) if _is_numeric([row[place] for row in tail if place < len(row)])]
    first = len(rows)
    while first and _is_data(rows[first - 1][1], numeric):
        first -= 1
    if len(numeric) < 2 or first == len(rows):
        return None
    if not first:
        raise BagError(f"{path}: numbers stand in its first line. Write a line above with the names of the columns.")
    units = next((found for _, row in reversed(rows[:first]) if (found := _units(row, numeric))), {})
    above = [row for row in rows[:first] if not _units(row[1], numeric)] or rows[:first]
    line, names = max(_headers(above), key=lambda header: _recognised(header[1], units))
    if sum(place < len(names) and bool(names[place]) for place in numeric) < 2:
        return None
    samples = [row for _, row in rows[first:]]
    begin = rows[first - 1][0] + 1
    cells = [row[place] for row in samples for place in numeric if place < len(row) and not _MOMENT.fullmatch(row[place])]
    given = [units.get(place, "") for place in range(len(names))]
    return LoggerLayout(
        encoding, separator, names, begin, given, _has_decimal_comma(path, cells, separator), samples[:200], line
    )


def _headers(above: list[tuple[int, list[str]]]) -> Iterator[tuple[int, list[str]]]:
    """Yield possible headers (line, names): nearest to the data first, names joined from two lines last."""
    yield from reversed(above)
    for (_, groups), (line, names) in zip(reversed(above[:-1]), reversed(above), strict=False):
        group, joined = "", []
        for place, name in enumerate(names):
            group = (groups[place] if place < len(groups) else "") or group
            joined.append(f"{group} {name}".strip())
        yield line, joined


def _recognised(names: list[str], units: Mapping[int, str]) -> int:
    """Return the number of names recognised as channels or times."""
    pairs = [(*split_header(name), place) for place, name in enumerate(names)]
    return sum(is_time(name) or bool(guess(name, unit or units.get(place, ""), None).channel) for name, unit, place in pairs)


def _is_numeric(cells: list[str]) -> bool:
    filled = [cell for cell in cells if cell.lower() not in BLANKS]
    return bool(filled) and sum(map(_is_value, filled)) >= NUMERIC_SHARE * len(filled)


def _is_value(cell: str) -> bool:
    return bool(_NUMBER.fullmatch(cell) or _MOMENT.fullmatch(cell))


def _is_data(row: Sequence[str], numeric: list[int]) -> bool:
    """Return True if most filled numeric cells of the row are values."""
    filled = [row[place] for place in numeric if place < len(row) and row[place].lower() not in BLANKS]
    return bool(filled) and sum(map(_is_value, filled)) > 0.5 * len(filled)


def _units(row: Sequence[str], numeric: list[int]) -> dict[int, str]:
    """Return units by column index, or an empty dict if this is no row of units."""
    cells = {place: row[place] for place in range(len(row)) if row[place] not in ("", "-", "1", "[-]")}
    own = {place: cell for place, cell in cells.items() if place in numeric[1:] or (place in numeric and unit_of(cell))}
    known = {place: unit_of(cell) for place, cell in own.items() if unit_of(cell)}
    return {place: unit_of(cell) or cell for place, cell in own.items()} if 2 * len(known) > len(own) else {}


def _has_decimal_comma(path: Path, cells: Sequence[str], separator: str) -> bool:
    """Return True if the decimal mark is a comma. Raise BagError if it may be a separator of thousands."""
    with_comma = [cell for cell in cells if "," in cell]
    if both := [cell for cell in with_comma if "." in cell]:
        return all(cell.rfind(",") > cell.rfind(".") for cell in both)
    points = [cell for cell in cells if "." in cell]
    if with_comma and points and all(map(_THOUSANDS.fullmatch, with_comma)):
        told = f"the comma in {with_comma[0]!r} is a separator of thousands or a decimal mark, beside {points[0]!r}"
        raise BagError(f"{path}: {told}. Export all numbers with one decimal mark.")
    return bool(with_comma) or not (points or separator == ",")


def number_in(cell: str, is_comma: bool) -> float:
    """Return the number of a cell, NaN if blank. Raise ValueError for any other text or an ambiguous number."""
    text = _GROUPING.sub("", cell.strip())
    if text.lower() in BLANKS:
        return float("nan")
    if is_comma:
        if "." in text and "," not in text and _THOUSANDS.fullmatch(text.replace(".", ",")):
            raise ValueError("a separator of thousands or a decimal mark")
        return float(text.replace(".", "").replace(",", ".") if "," in text else text)
    return float(text.replace(",", "") if _THOUSANDS.fullmatch(text.partition(".")[0]) else text)
