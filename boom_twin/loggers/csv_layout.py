"""Layout of a CSV file (encoding, separator, header, units, decimal mark), and channels by their names in headers."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from ..errors import BagError
from ..types import NUMBER, SENSORS, Stream, stream_of

UNIT_NAMES = {
    "m": ("meter", "metre"),
    "cm": ("zentimeter",),
    "mm": ("millimeter", "millimetre", "milimeter"),
    "um": ("µm", "μm", "mikrometer"),
    "in": ("inch", "zoll"),
    "deg": ("°", "grad", "degree", "degrees"),
    "m/s^2": ("m/s2", "m/s²", "m/s**2", "m_s2", "m/sec^2"),
    "s": ("sec", "second", "seconds", "sek", "sekunde", "sekunden"),
    "ms": ("msec", "milliseconds", "millisekunden"),
    "us": ("µs", "μs", "microseconds"),
    "ns": ("nanoseconds",),
    "d": ("day", "days", "tage"),
}
"""Other spellings of units, in lower case."""
TIME_UNITS = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1, "min": 60 * 10**9, "h": 3600 * 10**9, "d": 86400 * 10**9}
"""Nanoseconds in a unit of time."""
CHANNEL_UNITS = {unit for kind in SENSORS.values() for unit in kind.units}
_OTHER_UNITS = (
    "bar", "mbar", "psi", "pa", "hpa", "kpa", "mpa", "°c", "degc", "k", "°f", "%", "v", "mv", "a", "ma", "hz", "khz", "rpm",
    "1/min", "u/min", "mm/s", "m/s", "m/s^3", "deg/s", "°/s", "rad/s", "nm", "knm", "kg", "t", "l/min", "l", "kw", "w",
    "counts", "digit",
)  # fmt: skip
_KNOWN = {unit.lower(): unit for unit in (*_OTHER_UNITS, *TIME_UNITS, *CHANNEL_UNITS)}
_KNOWN |= {name: unit for unit, names in UNIT_NAMES.items() for name in names}
_BRACKETS = re.compile(r"^(.*?)[\s_,]*(?:\[([^\[\]]*)\]|\(([^()]*)\)|<([^<>]*)>|\{([^{}]*)\})\s*$", re.DOTALL)
_WORD_IN = re.compile(r"^(.*\S)(?:\s+in\s+|\s*/\s*|\s*,\s*)(\S+)$", re.DOTALL)
_BARE = sorted((name for name, unit in _KNOWN.items() if unit in CHANNEL_UNITS | {*TIME_UNITS}), key=len, reverse=True)
_AT_END = re.compile(rf"^(.*[^\W_])[\s_]+({'|'.join(map(re.escape, _BARE))})$", re.DOTALL | re.IGNORECASE)

_WORDS = {
    Stream.FORCES: ("force", "kraft", "kraeft", "load pin"),
    Stream.IMU: ("accel", "beschl", "imu", r"\bacc\b"),
    Stream.ANGLES: ("joint", "gelenk", "winkel", "angle", "encoder", "drehgeber"),
    Stream.STROKES: (
        "cylinder", r"\bcyl", "zylinder", r"\bzyl", "stroke", "length", "piston", "hub", "laenge", r"\bweg\b", "kolben",
    ),
}  # fmt: skip
"""Patterns of the words for each stream."""
_OVER = (Stream.FORCES, Stream.IMU)  # streams that take precedence if a header names several, as in 'cylinder force'
_NOT_READINGS = (
    r"soll|setpoint|target|command|\bcmd|desired|\bref\b|speed|veloc|geschw|\brate\b|temp|druck|pressure|status|fehler|error"
    r"|alarm|quality|\bmin\b|\bmax\b|mittel|\bmean|\bavg|\brms\b|\bstd\b|offset|strom\b|current|spannung|volt|diff|abweich"
    r"|ventil|valve"
)
_INCLINATION = r"inclin|neigung|\bincl|tilt|horizont"
_PATH = re.compile(r"::|\\|(?<=\w)\.(?=[A-Za-z])")  # separators of device, message and signal in a name
_TIME = (
    r"^(t|x|abs|rel|log)?[ _]*(time|zeit|timestamp|zeitstempel|stamp|datum|date|uhrzeit|clock|x value|t|sekunden|seconds)s?\b"
)


class Guess(NamedTuple):
    """Channel and unit of a column by its header, or the reason why none is recognised."""

    channel: str = ""
    unit: str = ""
    reason: str = ""


def unit_of(text: str) -> str:
    """Return this package's name of a unit, empty if the text is no known unit."""
    return _KNOWN.get(re.sub(r"\s+", "", text.strip("[](){}<> \t\n")).lower(), "")


def split_header(text: str) -> tuple[str, str]:
    """Return name and unit of a header such as ``Kraft 3 in kN`` or ``Winkel 2 (deg)``. The unit may be empty or unknown."""
    text = " ".join(text.split())
    if found := _BRACKETS.match(text):
        name, *units = found.groups()
        unit = next(each for each in units if each is not None).strip()
        if name and (unit_of(unit) or found[2] is not None):
            return name, unit_of(unit) or unit
    for pattern in (_WORD_IN, _AT_END):
        if (found := pattern.match(text)) and unit_of(found[2]):
            return found[1], unit_of(found[2])
    return text, ""


def is_time(name: str) -> bool:
    return bool(re.search(_TIME, _folded(name)))


def guess(name: str, unit: str, joints: int | None) -> Guess:
    """Return the channel of a column if name and unit fit only one.

    `joints` is the number of joints of the boom, if it is known.
    """
    if (stream := stream_of(name)) is not None and not unit:
        return Guess(name, SENSORS[stream].unit)
    last = _folded(_PATH.split(name)[-1])
    words = last if _named(last) else _folded(name)
    if re.search(_INCLINATION, words):
        return Guess(reason="an inclinometer: name its joint, and give absolute: root or head in a mapping")
    named = _named(words)
    if not named:
        return Guess(reason="no channel's name is in it")
    if found := re.search(_NOT_READINGS, words):
        return Guess(reason=f"{found[0].strip()!r}: no reading of a channel")
    named = next(({stream} for stream in _OVER if stream in named), named)
    fitting = {stream for stream in named if unit in SENSORS[stream].units} if unit else named
    if not fitting:
        units = " or ".join(", ".join(SENSORS[stream].units) for stream in named)
        return Guess(reason=f"unit {unit}, not {units}")
    if len(fitting) > 1:
        return Guess(reason="it may be a stroke or an angle: give its unit")
    (stream,) = fitting
    end = _end(words, stream)
    channel = f"{SENSORS[stream].stem}_{end}"
    if not end or stream_of(channel) is not stream:
        ends = SENSORS[stream].ends
        return Guess(reason=f"its axis is none of {', '.join(ends)}" if ends else "its number is not known")
    if joints is not None and end.isdigit() and int(end) > joints:
        return Guess(reason=f"the scene has {joints} joints")
    return Guess(channel, unit)


def _named(words: str) -> set[Stream]:
    return {stream for stream, stems in _WORDS.items() if any(re.search(stem, words) for stem in stems)}


def _end(words: str, stream: Stream) -> str:
    """Return the suffix of a channel: axis, number beside the word, or only number. It is empty if unknown."""
    numbers = [text.lstrip("0") for text in re.findall(r"\d+", words)]
    if ends := SENSORS[stream].ends:
        axes = re.findall(rf"\b({'|'.join(ends)})\b", words)
        return axes[0] if len(axes) == 1 and not set(numbers) - {"1"} else ""
    beside = [
        match[1]
        for stem in _WORDS[stream]
        for match in re.finditer(rf"{stem}[a-z]*[ _.:#-]*(?:nr[ .]*|no[ .]*)?0*(\d+)", words)
    ]
    found = {*beside} or {*numbers}
    if not found and len(letters := re.findall(r"\b([a-h])\b", words)) == 1:
        return str("abcdefgh".index(letters[0]) + 1)
    end = found.pop() if len(found) == 1 else ""
    return end if NUMBER.fullmatch(end) else ""


def _folded(name: str) -> str:
    """Return a name in lower case, without umlauts, with spaces where case or kind of character changes."""
    name = re.sub(r"(?<=[a-zäöüß])(?=[A-ZÄÖÜ])", " ", name)
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss")):
        name = name.replace(umlaut, letters).replace(umlaut.upper(), letters)
    name = re.sub(r"(?<=[A-Za-z])(?=\d)|(?<=\d)(?=[A-Za-z])", " ", name)
    return re.sub(r"[_\W]+", " ", name).strip().lower()


HEAD = 2**18  # bytes read to detect the layout
SEPARATORS = {"\t": "tab", ";": ";", ",": ",", "|": "|"}
"""Names of separators in order of trial: first tab and ; (never decimal marks)."""
BLANKS = {
    "", "-", "--", "---", "nan", "-nan", "null", "none", "na", "n/a", "#n/a", "1.#qnan", "-1.#ind", "#nv", "#wert!", "#div/0!",
    "#num!", "#value!", "inf", "-inf",
}  # fmt: skip
"""Texts of cells without a value, in lower case."""
_MARKS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
"""Encodings by the byte order mark at the start of a file."""
_NUMBER = re.compile(r"[+-]?(\d[\d'. ]*([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?", re.IGNORECASE)
_MOMENT = re.compile(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}.*|.*\d{1,2}:\d{2}.*")
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")


@dataclass(frozen=True, slots=True)
class CsvLayout:
    """Layout of a CSV file, with its header and first rows."""

    encoding: str
    separator: str
    names: list[str]  # headers of its columns
    first_line: int  # line of its first row of data, from 1
    units: list[str]
    """Units from the row of units, or empty strings. Known units have this package's spelling."""
    is_comma: bool  # True if the decimal mark is a comma
    samples: list[list[str]]  # first rows of data
    header_line: int
    head: list[list[str]]  # rows above the data: a logger that restarts repeats them

    def is_data(self, row: list[str]) -> bool:
        """Return True if a stripped row holds a value. Raise ValueError if it is a header of other columns."""
        if row in self.head or (row[0][:1] == "#" and row[0].lower() not in BLANKS):
            return False
        is_one = any(map(_is_value, row))
        if not is_one and _recognised_count(row, {}) > 1:
            raise ValueError(f"another header, {self.separator.join(row)[:80]!r}")
        return is_one

    @property
    def text(self) -> str:
        mark = "decimal comma" if self.is_comma else "decimal point"
        return f"{self.encoding}, separator {SEPARATORS[self.separator]}, {mark}, header in line {self.header_line}"


def layout_of(path: Path) -> CsvLayout:
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
    text = "\n".join("" if "\0" in line else line for line in text.split("\n"))  # a power cut leaves NULs
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
    decoder = codecs.getincrementaldecoder("utf-8")()
    with path.open("rb") as file:
        head = file.read(HEAD)
        if marked := next((encoding for mark, encoding in _MARKS.items() if head.startswith(mark)), ""):
            return marked
        first, second = head[::2].count(0), head[1::2].count(0)
        if abs(first - second) > len(head) // 4:
            return "utf-16-le" if second > first else "utf-16-be"
        try:
            block = head
            while block:
                decoder.decode(block)
                block = file.read(2**20)
            decoder.decode(b"", True)
        except UnicodeDecodeError:
            return "cp1252"
    return "utf-8"


def _table(path: Path, text: str, separator: str, encoding: str) -> CsvLayout | None:
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
    is_data = [_is_data(row, numeric) for _, row in rows]
    units = next((found for _, row in reversed(rows) if (found := _units(row, numeric))), {})
    plain = [row for row, is_one in zip(rows, is_data, strict=True) if not is_one]
    heads = [*_headers([row for row in plain if not _units(row[1], numeric)] or plain)]
    scores = [_recognised_count(names, units) for _, names in heads]
    if max(scores, default=0) < 2:  # no known names: columns that are numeric below
        scores = [sum(place < len(names) and bool(names[place]) for place in numeric) for _, names in heads]
    # data begin below the first header that names half as many columns as the best; later ones are repeated, or refused
    header = min((line for (line, _), score in zip(heads, scores, strict=True) if 2 * score >= max(scores)), default=0)
    below = [place for place, (line, _) in enumerate(rows) if line > header and is_data[place]]
    below = [place for place in below if place + 1 == len(rows) or not _units(rows[place + 1][1], numeric)]
    if len(numeric) < 2 or not below:
        return None
    if not (first := below[0]):
        raise BagError(f"{path}: numbers stand in its first line. Write a line above with the names of the columns.")
    bare = [len(cells := [*filter(None, row)]) > 1 and all(map(_is_value, cells)) for _, row in rows[:first]]
    if any(map(all, pairwise(bare))):
        raise BagError(f"{path}: rows of numbers stand above the header in line {header}. Cut the file there.")
    own = [(score, head) for head, score in zip(heads, scores, strict=True) if head[0] <= rows[first - 1][0]]
    line, names = max(own, key=lambda each: each[0])[1]
    if sum(place < len(names) and bool(names[place]) for place in numeric) < 2:
        return None
    head, samples = ([row for _, row in part] for part in (rows[:first], rows[first:]))
    cells = [row[place] for row in samples for place in numeric if place < len(row) and not _MOMENT.fullmatch(row[place])]
    given = [units.get(place, "") for place in range(len(names))]
    is_comma = _has_decimal_comma(path, cells, separator)
    return CsvLayout(encoding, separator, names, rows[first - 1][0] + 1, given, is_comma, samples[:200], line, head)


def _headers(above: list[tuple[int, list[str]]]) -> Iterator[tuple[int, list[str]]]:
    """Yield possible headers (line, names): nearest to the data first, names joined from two lines last."""
    yield from reversed(above)
    for (_, groups), (line, names) in zip(reversed(above[:-1]), reversed(above), strict=False):
        group, joined = "", []
        for place, name in enumerate(names):
            group = (groups[place] if place < len(groups) else "") or group
            joined.append(f"{group} {name}".strip())
        yield line, joined


def _recognised_count(names: list[str], units: Mapping[int, str]) -> int:
    pairs = [(*split_header(name), place) for place, name in enumerate(names)]
    return sum(is_time(name) or bool(guess(name, unit or units.get(place, ""), None).channel) for name, unit, place in pairs)


def _is_numeric(cells: list[str]) -> bool:
    numeric_share = 0.6  # least share of numbers and times among the filled cells of a numeric column
    filled = [cell for cell in cells if cell.lower() not in BLANKS]
    return bool(filled) and sum(map(_is_value, filled)) >= numeric_share * len(filled)


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
    if with_comma and points and all(map(THOUSANDS.fullmatch, with_comma)):
        told = f"the comma in {with_comma[0]!r} is a separator of thousands or a decimal mark, beside {points[0]!r}"
        raise BagError(f"{path}: {told}. Export all numbers with one decimal mark.")
    return bool(with_comma) or not (points or separator == ",")
