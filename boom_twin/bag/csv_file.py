"""Read a session from a CSV file: a row for every stamp, a column for every sensor, in SI units.

``t_s,stroke_1_m,..[,joint_1_rad,..][,imu_x_m_s2,imu_z_m_s2][,cylinder_force_1_N,..]``, an empty cell where there is no value.
Strokes may be missing where there are angles: for a mapping with ``drive: angles``.
The file may be of any size: it is read some thousand rows at a time. It is read once to check and count, and once more for its
messages.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from decimal import Decimal
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from ..errors import BagError
from ..messages.topic_table import load_topics
from ..messages.type_store import jazzy
from ..system.csv_table import NOTHING, CsvTable, read_csv_pieces
from ..system.received_files import open_received
from ..types import SECOND, SENSORS, Sample, Stream, channels_of
from .session_file import SessionFile, channel_of, schema_of
from .session_writer import samples_of, sensor_message

TIME = "t_s"
_NUMBERED = re.compile(r"(?:stroke_(\d{1,3})_m|joint_(\d{1,3})_rad|cylinder_force_(\d{1,3})_N)")
ROWS_TO_JUDGE, SLOWEST_STEP, FASTEST_STEP = 20, 1.0, 1e-4  # rows; s from row to row, by which the unit of the times is known
UNITS = {"ms": 1e3, "us": 1e6, "ns": 1e9}  # of which a second has so many
NUMBERS = {stream: number for number, stream in enumerate(Stream, 1)}  # channel number of every stream


@dataclass(frozen=True, slots=True)
class CsvFile(SessionFile):
    """Content of one CSV file. Its log times are its stamps."""

    def heads(self) -> Iterator[tuple[int, int, bytes]]:
        """Yield messages as in `SessionFile`, in the order of log times."""
        encode = jazzy().serialize_cdr
        for sample in _samples(self.path):
            data = encode(sensor_message(sample), SENSORS[sample.stream].message)
            yield NUMBERS[sample.stream], sample.stamp, bytes(data)


def summarise(path: Path) -> CsvFile:
    """Return the content of one file. A BagError names a column or value that cannot be used, and its line."""
    try:
        open_received(path).close()
    except OSError as error:
        raise BagError(f"{path}: cannot be read ({error.strerror}). Check the path and its permissions.") from error
    counts, start, end = dict.fromkeys(Stream, 0), 0, 0
    for sample in _samples(path):
        counts[sample.stream] += 1
        start, end = start or sample.stamp, sample.stamp
    topics = load_topics().inputs
    streams = [stream for stream in Stream if counts[stream]]
    return CsvFile(
        path=path,
        storage="csv",
        library="CSV",
        compression="none",
        channels={NUMBERS[stream]: channel_of(NUMBERS[stream], topics[stream].absolute) for stream in streams},
        schemas={NUMBERS[stream]: schema_of(NUMBERS[stream], topics[stream].type) for stream in streams},
        counts={NUMBERS[stream]: counts[stream] for stream in streams},
        start=start,
        end=end,
    )


def _samples(path: Path) -> Iterator[Sample]:
    """Yield all samples in the order of their stamps."""
    shift = 0
    last: int | None = None
    for number, piece in enumerate(_with_equal_times_joined(read_csv_pieces(path, BagError))):
        columns = _columns_of(piece)
        stamps = _stamps(piece, last)
        if number == 0 or stamps[-1] >= 2**31 * SECOND:
            _refuse_other_units(piece, stamps)
            shift = max(0, SECOND - stamps[0])
        last = stamps[-1]
        values = {
            stream: np.column_stack([_column(piece, name) for name in names])
            for stream, names in columns.items()
            if any(name in piece.names for name in names)
        }
        yield from samples_of(np.array(stamps, np.int64) + shift, values)


def _columns_of(table: CsvTable) -> dict[Stream, list[str]]:
    """Return the column names of every stream; refuse a header that lacks a required column or has an unknown one."""
    numbers = [max(map(int, filter(None, found.groups()))) for name in table.names if (found := _NUMBERED.fullmatch(name))]
    joints = max(numbers, default=1)
    channels = channels_of(joints)
    columns = {
        Stream.STROKES: [f"stroke_{number}_m" for number in range(1, joints + 1)],
        Stream.ANGLES: [f"{name}_rad" for name in channels[Stream.ANGLES]],
        Stream.IMU: ["imu_x_m_s2", "imu_z_m_s2"],
        Stream.FORCES: [f"{name}_N" for name in channels[Stream.FORCES]],
    }
    has_strokes = any(name in table.names for name in columns[Stream.STROKES])
    is_by_angles = not has_strokes and any(name in table.names for name in columns[Stream.ANGLES])
    table.require(
        [TIME, *columns[Stream.ANGLES if is_by_angles else Stream.STROKES]],
        " `boom_twin import` reads files with other headers.",
    )
    _refuse_unknown(table, [TIME, *(name for names in columns.values() for name in names)])
    return columns


def _refuse_unknown(table: CsvTable, known: list[str]) -> None:
    for name in table.names:
        if name not in known:
            near = get_close_matches(name, known, n=1, cutoff=0.6)
            remedy = (
                f"Did you mean {near[0]}?"
                if near
                else f"Known are {', '.join(known)}; take the column out, or use `boom_twin import`."
            )
            raise BagError(f"{table.path}: unknown column {name!r} in its first line. {remedy}")
        if table.names.count(name) > 1:
            raise BagError(f"{table.path}: column {name} is there twice. Take one out.")


def _column(table: CsvTable, name: str) -> list[float]:
    return table.column(name, np.nan) if name in table.names else [np.nan] * len(table.rows)


def _stamps(table: CsvTable, last: int | None) -> list[int]:
    """Return the times of all rows, ns. Refuse a time that is not after the one before (`last`: before the first row)."""
    place = table.names.index(TIME)
    found: list[int] = []
    for row, line in zip(table.rows, table.lines, strict=True):
        text = row[place].strip() if place < len(row) else ""
        try:
            stamp = int((Decimal(text) * SECOND).to_integral_value())
        except (ArithmeticError, ValueError):
            raise BagError(f"{table.path}, line {line}: {TIME} = {text!r} is not a time in s.") from None
        if last is not None and stamp <= last:
            remedy = f"Sort the rows by {TIME}." if stamp < last else "Both have this time: give each its own, or take one out."
            raise BagError(f"{table.path}, line {line}: {TIME} = {text} is not after the row before. {remedy}")
        found.append(stamp)
        last = stamp
    return found


def _refuse_other_units(table: CsvTable, stamps: list[int]) -> None:
    """Refuse times whose step is that of ms, us or ns, or that are too large for a stamp."""
    step = float(np.median(np.diff(stamps))) / SECOND if len(stamps) > 1 else 0.0
    if stamps[-1] < 2**31 * SECOND and (len(stamps) < ROWS_TO_JUDGE or step < SLOWEST_STEP):
        return
    told = f"{TIME} goes on by {step:g} s from row to row up to {stamps[-1] / SECOND:.10g} s"
    unit = next((unit for unit, count in UNITS.items() if FASTEST_STEP <= step / count < SLOWEST_STEP), None)
    remedy = "Divide it by 1000 if it is in ms, by 1e6 if in us, by 1e9 if in ns." if unit is None else ""
    if unit is not None:
        told, remedy = f"{told}, as if in {unit}", f"Divide it by {UNITS[unit]:g}."
    raise BagError(f"{table.path}: {told}, so not in seconds: a twin needs several rows a second. {remedy}")


def _with_equal_times_joined(pieces: Iterable[CsvTable]) -> Iterator[CsvTable]:
    """Yield tables with rows of equal time joined, unless a column has two values. Many files have a row for each topic."""
    rows, lines = list[list[str]](), list[int]()
    for piece in pieces:
        place = piece.names.index(TIME) if TIME in piece.names else -1
        for row, line in zip(piece.rows, piece.lines, strict=True):
            pairs = list(zip(rows[-1], row, strict=False)) if rows and len(rows[-1]) == len(row) else []
            if pairs and place >= 0 and pairs[place][0] == pairs[place][1] and _are_apart(pairs, place):
                rows[-1] = [b if a.strip().lower() in NOTHING else a for a, b in pairs]
            else:
                rows.append(row)
                lines.append(line)
        if len(rows) > 1:
            yield replace(piece, rows=rows[:-1], lines=lines[:-1])
        rows, lines = rows[-1:], lines[-1:]
    yield replace(piece, rows=rows, lines=lines)


def _are_apart(pairs: list[tuple[str, str]], place: int) -> bool:
    """Return True if no column except the time has a value in both rows."""
    return all(i == place or any(cell.strip().lower() in NOTHING for cell in pair) for i, pair in enumerate(pairs))
